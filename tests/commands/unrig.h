#pragma once
#include <sys/wait.h>

#include <cstdlib>
#include <string>

#include "core/files/text_file.h"
#include "tests/commands/unrig_binary.h"
#include "tests/support/temporary_directory.h"

namespace unrig::test {

/// What the binary did: exit status, standard output and standard error.
struct Outcome {
  int status = -1;
  std::string out, err;
};

/// Runs `unrig ARGUMENTS` through the shell; arguments with blanks need quotes.
inline Outcome unrig(const std::string& arguments, const TemporaryDirectory& directory) {
  const std::string out = directory.path("stdout.txt"), err = directory.path("stderr.txt");
  const int status = std::system((unrig_binary() + " " + arguments + " >" + out + " 2>" + err).c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(out), read_text(err)};
}

}  // namespace unrig::test
