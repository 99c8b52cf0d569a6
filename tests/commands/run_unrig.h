#pragma once
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/commands/unrig_binary.h"
#include "tests/support/temporary_directory.h"

extern char** environ;

namespace unrig::test {

/// What a call of the binary left behind.
struct Finished {
  int status = -1;  ///< exit status; -1 where it did not end by itself
  std::string out, err;
  long peak_memory = 0;  ///< KB
};

inline std::string whole_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Runs `unrig ARGUMENTS...` and waits for its end. Standard output and error go to files of `directory`, so neither can fill up a pipe.
inline Finished run_unrig(const TemporaryDirectory& directory, const std::vector<std::string>& arguments) {
  std::vector<std::string> words{unrig_binary()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const std::string out = directory.path(".out"), err = directory.path(".err");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  pid_t child = 0;
  const int failure = posix_spawn(&child, argv.front(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  Finished finished;
  if (failure != 0) {
    ADD_FAILURE() << argv.front() << " cannot be started";
    return finished;
  }
  int status = 0;
  rusage used{};
  if (::wait4(child, &status, 0, &used) == child && WIFEXITED(status)) finished.status = WEXITSTATUS(status);
  finished.peak_memory = used.ru_maxrss;
  finished.out = whole_file(out);
  finished.err = whole_file(err);
  return finished;
}

}  // namespace unrig::test
