#include "core/files/run_command.h"

#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include "core/files/error.h"
#include "core/files/last_progress.h"
#include "core/files/provenance.h"

namespace unrig {
namespace {

/// What was being done, as a part of a sentence.
std::string meanwhile() { return last_progress().empty() ? "" : " while " + last_progress(); }

/// An exception that no command foresees: what was being done, with which files, and where to turn.
void tell_of_a_fault(const Command& command, int argc, char** argv, const std::string& what) {
  std::fprintf(stderr, "unrig %s: stopped%s: %s.\nNo file should lead to this: it is a fault of %s. Please report it to whoever you have unrig from, with the files of this call:\n  unrig", command.name,
               meanwhile().c_str(), what.c_str(), provenance_of(0, nullptr).program.c_str());
  for (int i = 0; i < argc; ++i) std::fprintf(stderr, " %s", argv[i]);
  std::fputs("\n", stderr);
}

}  // namespace

int run_command(const Command& command, int argc, char** argv, bool* fault) {
  try {
    return command.run(argc, argv);
  } catch (const InputError& e) {
    std::fprintf(stderr, "unrig %s: %s\n", command.name, e.what());
    return exit_wrong_use;
  } catch (const NoAnswer& e) {
    std::fprintf(stderr, "unrig %s: %s\n", command.name, e.what());
    return exit_no_answer;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "unrig %s: the memory of this machine is not enough%s\n", command.name, meanwhile().c_str());
  } catch (const std::exception& e) {
    tell_of_a_fault(command, argc, argv, e.what());
  }
  if (fault) *fault = true;
  return exit_no_answer;
}

}  // namespace unrig
