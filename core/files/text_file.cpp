#include "core/files/text_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/files/error.h"
#include "core/files/together.h"

namespace unrig {
namespace {

namespace fs = std::filesystem;

std::string reason() { return std::strerror(errno); }

[[noreturn]] void refuse_write(const std::string& path, const std::string& why, const std::string& advice = "") {
  throw InputError({path, 0}, "the file cannot be written: " + why, "wanted a path that can be written", advice);
}

/// An open file that closes itself, so that every way out is clean.
class OpenFile {
 public:
  OpenFile() = default;
  OpenFile(const std::string& path, int flags, mode_t mode = 0) { open(path, flags, mode); }
  ~OpenFile() {
    if (number_ >= 0) ::close(number_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  /// Closes what was open before.
  void open(const std::string& path, int flags, mode_t mode = 0) {
    if (number_ >= 0) ::close(number_);
    number_ = ::open(path.c_str(), flags | O_CLOEXEC, mode);
  }
  bool is_open() const { return number_ >= 0; }
  int number() const { return number_; }
  /// False with errno where the system could not keep what was written.
  bool close() { return ::close(std::exchange(number_, -1)) == 0; }

 private:
  int number_ = -1;
};

std::optional<struct stat> status(const std::string& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) return std::nullopt;
  return found;
}

bool write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Gathers what comes into blocks that are worth a call of the system. False with errno where one cannot be written; the source is then not asked for more.
bool write_pieces(int file, const TextSource& text) {
  const std::size_t block = 1 << 16;
  std::string waiting;
  const auto write = [&](std::string_view piece) {
    if (!write_all(file, piece)) throw std::system_error(errno, std::generic_category());
  };
  try {
    text([&](std::string_view piece) {
      if (waiting.size() + piece.size() < block) {
        waiting += piece;
        return;
      }
      write(waiting);
      waiting.clear();
      write(piece);
    });
    write(waiting);
    return true;
  } catch (const std::system_error& failure) {
    errno = failure.code().value();
    return false;
  }
}

/// /dev/stdout may lead to a regular file: whoever opened it goes on writing to it, so it must not be replaced.
bool is_written_directly(const std::string& path, const struct stat& old) { return !S_ISREG(old.st_mode) || path.starts_with("/dev/") || path.starts_with("/proc/"); }

/// Pipes and devices cannot be renamed over, and keep no half-written file either.
void write_directly(const std::string& path, const TextSource& text) {
  OpenFile file(path, O_WRONLY | O_APPEND);
  if (!file.is_open() || !write_pieces(file.number(), text) || !file.close()) refuse_write(path, reason());
}

/// The file that `path` means: the end of a chain of symbolic links, which stay as they are.
fs::path followed(const std::string& path) {
  fs::path target = path;
  std::error_code failure;
  for (int links = 0; fs::is_symlink(target, failure); ++links) {
    if (links == 40) refuse_write(path, std::strerror(ELOOP));
    const fs::path next = fs::read_symlink(target, failure);
    if (failure) refuse_write(path, failure.message());
    target = target.parent_path() / next;  // an absolute `next` replaces the left side
  }
  return target;
}

/// A new file in the target's folder, gone again unless it is renamed over the target. It has no name until it is whole (O_TMPFILE), so that
/// a killed process leaves nothing behind; file systems that cannot do that get a named one.
class TemporaryFile {
 public:
  TemporaryFile(const fs::path& target, mode_t mode) : target_(target), path_(unused_name(target)) {
    const fs::path folder = target.parent_path();
    file_.open(folder.empty() ? "." : folder.string(), O_WRONLY | O_TMPFILE, mode);
    if (file_.is_open() && ::access(link().c_str(), F_OK) == 0) return;
    file_.open(path_, O_WRONLY | O_CREAT | O_EXCL, mode);
    named_ = file_.is_open();
  }
  ~TemporaryFile() {
    if (named_) ::unlink(path_.c_str());
    if (placed_) ::unlink(target_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  bool take_mode(mode_t mode) const { return file_.is_open() && ::fchmod(file_.number(), mode & 07777) == 0; }
  /// These give false with errno where a step fails. fsync comes before the name: a crash leaves the old file or the whole new one.
  bool write(const TextSource& text) const { return file_.is_open() && write_pieces(file_.number(), text) && ::fsync(file_.number()) == 0; }
  /// That of a target which is not there yet; beside one that is there a name of its own, which is left where the process is killed before it is the target's.
  bool take_name() {
    const auto linked_as = [&](const fs::path& name) { return ::linkat(AT_FDCWD, link().c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0; };
    if (!named_) placed_ = linked_as(target_);
    if (!named_ && !placed_) named_ = linked_as(path_);
    return (named_ || placed_) && file_.close();
  }
  bool replace_target() {
    if (placed_) {
      placed_ = false;
      return true;
    }
    if (::rename(path_.c_str(), target_.c_str()) != 0) return false;
    named_ = false;
    return true;
  }
  fs::path folder() const { return target_.parent_path(); }

 private:
  /// Short, so that a target whose name is as long as the system allows can still be written.
  static std::string unused_name(const fs::path& target) {
    static std::atomic<int> count = 0;
    fs::path name;
    std::error_code ignored;  // the opening of the file reports what is wrong with the directory
    do {
      name = target.parent_path() / fmt::format(".unrig-{}-{}.tmp", ::getpid(), ++count);
    } while (fs::exists(fs::symlink_status(name, ignored)));
    return name.string();
  }
  /// What a file without a name is linked by; absent where /proc is.
  std::string link() const { return fmt::format("/proc/self/fd/{}", file_.number()); }

  fs::path target_;
  std::string path_;
  OpenFile file_;
  bool named_ = false, placed_ = false;  // placed: in the place of a target that was not there
};

/// The rename itself lives in the directory; where a file system cannot flush directories the file is written all the same.
void flush_directory(const fs::path& directory) {
  const OpenFile opened(directory.empty() ? "." : directory.string(), O_RDONLY | O_DIRECTORY);
  if (opened.is_open()) ::fsync(opened.number());
}

/// Holds up what would end the process, as long as it lives.
class NoSignals {
 public:
  NoSignals() {
    sigset_t all;
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_BLOCK, &all, &before_);
  }
  ~NoSignals() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  NoSignals(const NoSignals&) = delete;
  NoSignals& operator=(const NoSignals&) = delete;

 private:
  sigset_t before_{};
};

/// All of `file` on disk, without its name yet; nothing where it was written directly.
std::unique_ptr<TemporaryFile> prepared(const TextFile& file) {
  const auto old = status(file.path);
  if (old && is_written_directly(file.path, *old)) {
    write_directly(file.path, file.text);
    return nullptr;
  }
  auto temporary = std::make_unique<TemporaryFile>(followed(file.path), 0666);
  if (old && !temporary->take_mode(old->st_mode)) refuse_write(file.path, reason());
  if (!temporary->write(file.text)) refuse_write(file.path, reason());
  return temporary;
}

void replace_all(const std::vector<TextFile>& files) {
  for (const TextFile& file : files) check_writable(file.path);
  std::vector<std::unique_ptr<TemporaryFile>> whole;
  for (const TextFile& file : files) whole.push_back(prepared(file));
  {
    const NoSignals while_files_change_places;
    for (const bool in_place : {false, true})
      for (std::size_t i = 0; i < whole.size(); ++i)
        if (whole[i] && !(in_place ? whole[i]->replace_target() : whole[i]->take_name())) refuse_write(files[i].path, reason());
  }
  for (const auto& file : whole)
    if (file) flush_directory(file->folder());
}

}  // namespace

namespace {

/// How much a path may give that is no regular file: some never end. A device that is no terminal holds no text at all, but /dev/null has an end.
std::size_t most_bytes(const struct stat& found, int file) {
  constexpr std::size_t of_device = 1 << 16, of_pipe = std::size_t{1} << 30;  // 30 million samples
  if (S_ISREG(found.st_mode)) return std::numeric_limits<std::size_t>::max();
  return (S_ISCHR(found.st_mode) || S_ISBLK(found.st_mode)) && ::isatty(file) == 0 ? of_device : of_pipe;
}

}  // namespace

std::string read_text(const std::string& path) try {
  const auto refuse = [&path](const std::string& why) {
    throw InputError({path, 0}, "the file cannot be read: " + why, "wanted a readable text file", "");
  };
  const OpenFile file(path, O_RDONLY);
  if (!file.is_open()) refuse(reason());
  std::string text;
  const auto found = status(path);
  const std::size_t block = 1 << 16;
  std::size_t size = 0;
  // One byte beyond the expected size lets the last read see the end of the file. Pipes have no size and grow the text instead.
  text.resize(found && found->st_size > 0 ? static_cast<std::size_t>(found->st_size) + 1 : block);
  while (true) {
    if (size == text.size()) text.resize(2 * size);
    const ssize_t got = ::read(file.number(), text.data() + size, text.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) refuse(reason());
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
    if (found && size > most_bytes(*found, file.number())) refuse(fmt::format("no end of it after {} kB", size >> 10));
  }
  text.resize(size);
  return text;
} catch (const std::bad_alloc&) {
  throw InputError({path, 0}, "the file cannot be read: it is larger than the memory", "wanted a readable text file", "");
}

std::string whole_text(const TextSource& text) {
  std::string whole;
  text([&](std::string_view piece) { whole += piece; });
  return whole;
}

std::string base_name(const std::string& path) { return fs::path(path).filename().string(); }

void write_text(const std::string& path, const std::string& text) {
  write_text(path, [&](const TextSink& sink) { sink(text); });
}

void check_writable(const std::string& path) {
  const auto old = status(path);
  if (old && S_ISDIR(old->st_mode)) refuse_write(path, std::strerror(EISDIR));
  if (old && is_written_directly(path, *old)) return;
  // A rename would step over the write protection of the old file.
  if (old && ::access(path.c_str(), W_OK) != 0) refuse_write(path, reason());
  const std::string folder = (followed(path).parent_path() / "").string();  // ends with /, so that a file in its place is an error too
  if (::access(folder.empty() ? "./" : folder.c_str(), W_OK | X_OK) == 0) return;
  const bool absent = errno == ENOENT;
  refuse_write(path, reason(), absent ? "The folder " + folder + " is not there; make it first." : "");
}

void write_text(const std::string& path, const TextSource& text) { replace_all({{path, text}}); }

void write_together(const std::vector<TextFile>& files) {
  std::vector<TextFile> wanted;
  std::copy_if(files.begin(), files.end(), std::back_inserter(wanted), [](const TextFile& file) { return !file.path.empty(); });
  replace_all(wanted);
}

}  // namespace unrig
