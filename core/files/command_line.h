#pragma once

namespace CLI {
class App;
}

namespace unrig {

/// `app.parse`, but that an option which the command does not have is named first, with the one that was probably meant: nothing else that is missing then is of
/// any help. Messages begin with the command's name. Throws CLI::ParseError, as `app.parse` does.
void parse_command_line(CLI::App& app, int argc, char** argv);

}  // namespace unrig
