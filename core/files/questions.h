#pragma once
#include <string>

namespace unrig {

/// How many questions a template asks its user: blocks of lines that begin with `# ?`, or `# # ?` in the head of a run file.
int questions_in(const std::string& text);

/// Throws InputError where a file of that name is there and `force` does not allow to write over it: what a user has filled in must not be lost to a template.
void refuse_overwriting(const std::string& path, bool force);

}  // namespace unrig
