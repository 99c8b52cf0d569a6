#include "correct/batch/child.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace unrig {
namespace {

[[noreturn]] void live(pid_t parent, std::FILE* said, const std::function<int(std::FILE*)>& work) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(128 + SIGKILL);  // it was gone before
  const int nowhere = ::open("/dev/null", O_RDWR);
  ::dup2(nowhere, STDIN_FILENO);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(::fileno(said), STDERR_FILENO);
  const int status = work(said);
  std::fflush(nullptr);
  ::_exit(status);  // what the parent set up is the parent's to take down
}

}  // namespace

Children::~Children() {
  for (const auto& [process, job] : jobs_) {
    ::kill(process, SIGKILL);
    ::waitpid(process, nullptr, 0);
    std::fclose(job.said);
  }
}

void Children::start(std::size_t job, const std::function<int(std::FILE*)>& work) {
  std::FILE* said = std::tmpfile();
  if (!said) throw std::system_error(errno, std::generic_category(), "no temporary file can be had");
  std::fflush(nullptr);  // or the child would write it once more
  const pid_t parent = ::getpid(), process = ::fork();
  if (process == 0) live(parent, said, work);
  if (process < 0) {
    const int failure = errno;
    std::fclose(said);
    throw std::system_error(failure, std::generic_category(), "no process can be had");
  }
  jobs_.emplace(process, Job{job, said});
}

Children::Ended Children::wait() {
  for (;;) {
    int status = 0;
    const pid_t process = ::waitpid(-1, &status, 0);
    if (process < 0 && errno == EINTR) continue;
    if (process < 0) throw std::system_error(errno, std::generic_category(), "a process was lost");
    const auto found = jobs_.find(process);
    if (found == jobs_.end()) continue;
    Ended ended{found->second.number, WIFEXITED(status) ? WEXITSTATUS(status) : 0, WIFSIGNALED(status) ? WTERMSIG(status) : 0, whole(found->second.said)};
    std::fclose(found->second.said);
    jobs_.erase(found);
    return ended;
  }
}

std::string whole(std::FILE* file) {
  std::string text;
  char piece[4096];
  ::off_t at = 0;
  for (ssize_t got = 0; (got = ::pread(::fileno(file), piece, sizeof piece, at)) > 0; at += got) text.append(piece, static_cast<std::size_t>(got));
  return text;
}

}  // namespace unrig
