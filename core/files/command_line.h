#pragma once
#include <string>

namespace CLI {
class App;
}

namespace unrig {

/// `app.parse`, but that an option which the command does not have is named first, with the one that was probably meant: nothing else that is missing then is of
/// any help. Messages begin with the command's name. Throws CLI::ParseError, as `app.parse` does.
void parse_command_line(CLI::App& app, int argc, char** argv);

/// For CLI::Option::check: what is wrong with a text that is no number above zero; "inf" is one. Empty: nothing.
std::string wrong_with_limit(const std::string& text);

}  // namespace unrig
