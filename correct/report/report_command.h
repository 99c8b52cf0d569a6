#pragma once

namespace unrig {

/// `unrig report RESULT... -o report.html`: results as one HTML file that opens from disk without a network.
int report_command(int argc, char** argv);

}  // namespace unrig
