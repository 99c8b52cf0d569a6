#pragma once
#include <string>
#include <string_view>

#include "core/import/delimited.h"

namespace unrig {

/// True where the text begins as LabVIEW's measurement files (.lvm) do.
bool is_lvm(std::string_view text);

/// Reads a LabVIEW measurement file: its two headers, then its table as read_delimited reads one. Names are the table's; units are the headers' where UDUNITS-2
/// knows them; the sampling interval is Delta_X where the file has no column of times, or one that agrees. Of a file with several headings the first table is
/// read, with a warning. `asked` overrules what the headers say of delimiter and decimal sign.
///
/// Throws InputError, with the line, for a header that does not end, and as read_delimited does. Source: NI, "Specification for the LabVIEW Measurement File (.lvm)".
Recording read_lvm(std::string_view text, const std::string& file, const DelimitedFormat& asked = {});

}  // namespace unrig
