#include "core/files/text_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "core/files/error.h"
#include "core/files/together.h"
#include "tests/support/temporary_directory.h"

namespace unrig {
namespace {

namespace fs = std::filesystem;
using test::TemporaryDirectory;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::size_t files_in(const fs::path& directory) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(directory), fs::directory_iterator()));
}

std::string refusal(const std::string& path) {
  try {
    write_text(path, "new");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(TextFile, WritesWhatItReads) {
  const TemporaryDirectory directory;
  std::string text = "a\r\n\xC2\xB5 no end of line";
  text.push_back('\0');
  text.append(200000, 'x');  // more than one block of a pipe or buffer
  write_text(directory.path("a.txt"), text);
  EXPECT_EQ(read_text(directory.path("a.txt")), text);
  write_text(directory.path("a.txt"), "");
  EXPECT_EQ(read_text(directory.path("a.txt")), "");
}

/// It was read without end.
TEST(TextFile, ADeviceWithoutAnEndIsRefused) {
  const auto said = [](const std::string& path) -> std::string {
    try {
      read_text(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(said("/dev/zero"), HasSubstr("/dev/zero: the file cannot be read: no end of it"));
  EXPECT_THAT(said("/dev/urandom"), HasSubstr("no end of it"));
  EXPECT_EQ(read_text("/dev/null"), "");
}

TEST(TextFile, PiecesBecomeOneTextWhateverTheirSize) {
  const TemporaryDirectory directory;
  const std::string path = directory.path("pieces.txt");
  std::string whole;
  const TextSource source = [&](const TextSink& sink) {
    whole.clear();
    for (int k = 0; k < 3000; ++k) {  // small ones gather, one larger than any buffer goes through, in their order
      const std::string piece = std::to_string(k) + std::string(k == 1500 ? 1 << 20 : static_cast<std::size_t>(k % 200), 'x');
      sink(piece);
      whole += piece;
    }
  };
  write_text(path, source);
  EXPECT_EQ(read_text(path), whole);
  EXPECT_EQ(whole_text(source), whole);
}

TEST(TextFile, ASourceThatThrowsHalfwayLeavesTheOldFile) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("run.csv", "old");
  const auto fails = [&](const TextSink& sink) {
    sink(std::string(1 << 20, 'x'));
    throw std::runtime_error("no more");
  };
  EXPECT_THROW(write_text(path, fails), std::runtime_error);
  EXPECT_EQ(read_text(path), "old");
  EXPECT_EQ(files_in(directory.path("")), 1u);
}

TEST(TextFile, ASourceIsNotAskedForMoreThanTheDeviceTakes) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "the system has no /dev/full";
  int asked = 0;
  EXPECT_THROW(write_text("/dev/full", [&](const TextSink& sink) {
    for (; asked < 1000; ++asked) sink(std::string(1 << 17, 'x'));
  }), InputError);
  EXPECT_EQ(asked, 0) << "the first piece already finds it full";
}

TEST(TextFile, ReadingWhatIsNotThereNamesPathAndReason) {
  const TemporaryDirectory directory;
  try {
    read_text(directory.path("none.csv"));
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("none.csv: "), HasSubstr("No such file")));
  }
  EXPECT_THROW(read_text(directory.path("")), InputError) << "a directory";
}

TEST(TextFile, LeavesNoTemporaryFileBehind) {
  const TemporaryDirectory directory;
  write_text(directory.path("a.txt"), "one");
  write_text(directory.path("a.txt"), "two");
  EXPECT_EQ(files_in(directory.path("")), 1u);
}

/// Names that come up in a folder from here on.
class NewNames {
 public:
  explicit NewNames(const fs::path& folder) : file_(::inotify_init1(IN_NONBLOCK)) { ::inotify_add_watch(file_, folder.c_str(), IN_CREATE); }
  ~NewNames() { ::close(file_); }
  NewNames(const NewNames&) = delete;
  NewNames& operator=(const NewNames&) = delete;

  std::vector<std::string> so_far() const {
    alignas(inotify_event) char events[4096];
    std::vector<std::string> names;
    const ssize_t size = ::read(file_, events, sizeof events);
    for (ssize_t at = 0; at < size;) {
      const auto* event = reinterpret_cast<const inotify_event*>(events + at);
      names.emplace_back(event->name);
      at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
    }
    return names;
  }

 private:
  int file_;
};

/// Where nothing is yet the file takes its own name at once: no kill leaves another.
TEST(TextFile, WhatIsNewHasNoOtherNameBefore) {
  const TemporaryDirectory directory;
  const int without_name = ::open(directory.path("").c_str(), O_WRONLY | O_TMPFILE, 0666);
  if (without_name < 0) GTEST_SKIP() << "this file system has no files without a name";
  ::close(without_name);
  const NewNames names(directory.path(""));
  write_text(directory.path("new.json"), "new");
  EXPECT_EQ(names.so_far(), std::vector<std::string>{"new.json"});
  write_text(directory.path("new.json"), "newer");
  EXPECT_EQ(read_text(directory.path("new.json")), "newer");
  EXPECT_EQ(files_in(directory.path("")), 1u);
}

TEST(TextFile, RefusesADirectoryAndLeavesItAlone) {
  const TemporaryDirectory directory;
  fs::create_directory(directory.path("results"));
  EXPECT_THAT(refusal(directory.path("results")), HasSubstr("directory"));
  EXPECT_TRUE(fs::is_directory(directory.path("results")));
  EXPECT_EQ(files_in(directory.path("")), 1u);
}

TEST(TextFile, RefusesADirectoryThatIsNotThere) {
  const TemporaryDirectory directory;
  EXPECT_THAT(refusal(directory.path("none/a.txt")), HasSubstr("No such file"));
}

TEST(TextFile, KeepsPermissionsOfTheOldFile) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("a.txt", "old");
  fs::permissions(path, fs::perms(0640));
  write_text(path, "new");
  EXPECT_EQ(fs::status(path).permissions(), fs::perms(0640));
}

TEST(TextFile, WritesThroughSymbolicLinks) {
  const TemporaryDirectory directory;
  directory.file("real.txt", "old");
  fs::create_symlink("real.txt", directory.path("link.txt"));
  write_text(directory.path("link.txt"), "new");
  EXPECT_TRUE(fs::is_symlink(directory.path("link.txt")));
  EXPECT_EQ(read_text(directory.path("real.txt")), "new");

  fs::create_symlink("later.txt", directory.path("dangling.txt"));
  write_text(directory.path("dangling.txt"), "new");
  EXPECT_TRUE(fs::is_symlink(directory.path("dangling.txt")));
  EXPECT_EQ(read_text(directory.path("later.txt")), "new");

  fs::create_symlink("loop.txt", directory.path("loop.txt"));
  EXPECT_THAT(refusal(directory.path("loop.txt")), HasSubstr("symbolic links"));
}

TEST(TextFile, WritesDirectlyToAPipe) {
  const TemporaryDirectory directory;
  const std::string path = directory.path("pipe");
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  std::string received;
  std::thread reader([&] { received = read_text(path); });
  const std::string sent(200000, 'x');
  write_text(path, sent);
  reader.join();
  EXPECT_EQ(received, sent);
  EXPECT_TRUE(fs::is_fifo(path));
}

TEST(TextFile, WritesDirectlyToADevice) {
  write_text("/dev/null", "gone");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(TextFile, AFullDeviceIsAnError) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "the system has no /dev/full";
  EXPECT_THAT(refusal("/dev/full"), HasSubstr("space"));
}

TEST(TextFile, ANameAsLongAsTheSystemAllows) {
  const TemporaryDirectory directory;
  const std::string path = directory.path(std::string(255, 'n'));
  write_text(path, "new");
  EXPECT_EQ(read_text(path), "new");
}

TEST(InputErrorMessage, HasOneShape) {
  EXPECT_STREQ(InputError({"a.csv", 3}, "found", "wanted", "Advice.").what(), "a.csv:3: found; wanted. Advice.");
  EXPECT_STREQ(InputError({"a.csv", 0}, "found", "wanted", "").what(), "a.csv: found; wanted.");
}

TextSource of(const std::string& text) {
  return [text](const TextSink& sink) { sink(text); };
}

TEST(Together, AllOrNone) {
  const TemporaryDirectory directory;
  const std::string first = directory.file("first", "old"), second = directory.file("second", "old");
  write_together({{first, of("new")}, {"", of("not wanted")}, {second, of("new")}});
  EXPECT_EQ(read_text(first) + read_text(second), "newnew");
  const auto fails = [](const TextSink& sink) {
    sink("half");
    throw std::runtime_error("in the middle");
  };
  EXPECT_THROW(write_together({{first, of("newer")}, {second, fails}}), std::runtime_error);
  EXPECT_THROW(write_together({{first, of("newer")}, {directory.path("absent/file"), of("newer")}}), InputError);
  EXPECT_EQ(read_text(first) + read_text(second), "newnew");
  EXPECT_EQ(files_in(directory.path("")), 2u);
}

/// In a child that does nothing but write pairs until it is told to end, at once, somewhere.
TEST(Together, ASignalDoesNotPartThem) {
  const TemporaryDirectory directory;
  const std::string first = directory.path("first"), second = directory.path("second");
  constexpr int times = 40;
  for (int k = 0; k < times; ++k) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0)
      for (int i = 0;; ++i) {
        const std::string text = std::to_string(k) + " " + std::to_string(i);
        write_together({{first, of(text)}, {second, of(text)}});
      }
    const std::string own = std::to_string(k) + " ";
    constexpr int at_most = 20000;  // ms, on a machine that is busy with other things
    for (int waited = 0; waited < at_most && !(fs::exists(second) && read_text(second).starts_with(own)); ++waited) ::usleep(1000);
    ::usleep(static_cast<useconds_t>(5000 + 1237 * k % 7000));
    ::kill(child, k % 2 == 0 ? SIGTERM : SIGINT);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFSIGNALED(status));
    ASSERT_EQ(read_text(first), read_text(second)) << k;
    EXPECT_TRUE(read_text(first).starts_with(own)) << "otherwise child " << k << " has tested nothing";
  }
}

}  // namespace
}  // namespace unrig
