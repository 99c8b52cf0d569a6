#include "core/import/uff.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/import/byte_reader.h"
#include "core/import/delimited.h"
#include "core/files/scan.h"

namespace unrig {
namespace {

/// The columns [first, first + width) of a line, without blanks around.
std::string_view field(std::string_view line, std::size_t first, std::size_t width) { return first < line.size() ? trimmed(line.substr(first, width)) : std::string_view{}; }

/// What a field says, if anything.
std::string told(std::string_view field) { return field == "NONE" ? "" : in_utf8(std::string(field)); }

/// Fortran writes exponents with D too.
bool read_fortran(std::string_view text, double& value) {
  std::string copy(text);
  std::replace_if(copy.begin(), copy.end(), [](char c) { return c == 'D' || c == 'd'; }, 'E');
  return !copy.empty() && read_number(copy.data(), copy.data() + copy.size(), value) == copy.data() + copy.size();
}

/// What records 6 to 9 say.
struct Header {
  std::string name, unit, title, reference_unit;
  int type = 0, node = 0, direction = 0, reference_node = 0, reference_direction = 0;
  int ordinate = 0;  ///< 2, 4: real, single and double; 5, 6: complex
  std::size_t points = 0;
  bool even = false;
  double start = 0, step = 0;
  bool complex() const { return ordinate > 4; }
  bool is_double() const { return ordinate == 4 || ordinate == 6; }
};

/// Of a 58b dataset: how its numbers are stored.
struct Binary {
  bool big_endian = false;
  bool ieee = true;
  std::size_t bytes = 0;
};

class UffFile {
 public:
  UffFile(std::string_view bytes, const std::string& file) : bytes_(bytes), out_{file, "UFF 58", {}, {}} {}

  Recording read() {
    read_all();
    if (out_.channels.empty())
      throw InputError({out_.file, line_number_}, functions_.empty() ? "the file holds no dataset 58 with real numbers" : "the functions of the file are complex", "wanted a universal file with datasets 58 of real numbers",
                       functions_.empty() ? "Copy it again, or export it once more." : "Of frequency response functions `unrig new rig --from impact-test FILE` makes a rig.");
    return std::move(out_);
  }

  std::vector<UffFunction> functions() {
    read_all();
    return std::move(functions_);
  }

 private:
  void read_all() {
    while (at_ < bytes_.size()) {
      if (trimmed(line()) != "-1") continue;
      if (at_ >= bytes_.size()) break;
      const std::string_view kind = line();
      const std::string_view number = field(kind, 0, 6);
      if (number == "58" || number == "58b")
        read_58(number == "58b" || field(kind, 6, 1) == "b", kind);
      else
        skip();
    }
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError({out_.file, line_number_}, what, "wanted a universal file with datasets 58", "Copy it again, or export it once more.");
  }

  std::string_view line() {
    if (at_ >= bytes_.size()) refuse("the file ends within a dataset");
    const std::size_t end = bytes_.find('\n', at_);
    std::string_view found = bytes_.substr(at_, end == std::string_view::npos ? end : end - at_);
    at_ = end == std::string_view::npos ? bytes_.size() : end + 1;
    ++line_number_;
    if (found.ends_with('\r')) found.remove_suffix(1);
    return found;
  }

  void skip() {
    while (at_ < bytes_.size() && trimmed(line()) != "-1") {
    }
  }

  double number(std::string_view line, std::size_t first, std::size_t width, const char* what) {
    double value = 0;
    const std::string_view text = field(line, first, width);
    if (text.empty()) return 0;  // Fortran reads blanks as zero
    if (!read_fortran(text, value)) refuse(fmt::format("{} is \"{}\"", what, text));
    return value;
  }

  int integer(std::string_view line, std::size_t first, std::size_t width, const char* what) {
    const double value = number(line, first, width, what);
    if (!(std::abs(value) < 2e9) || value != std::floor(value)) refuse(fmt::format("{} is no integer", what));
    return static_cast<int>(value);
  }

  Header header() {
    Header h;
    h.title = trimmed(line());
    for (int record = 2; record <= 5; ++record) line();
    const std::string_view entity = line();
    const int direction = integer(entity, 51, 4, "the direction");
    constexpr std::array axes = {"0", "+X", "+Y", "+Z", "+RX", "+RY", "+RZ"};
    const auto axis = static_cast<std::size_t>(std::abs(direction));
    std::string name = axis < axes.size() ? axes[axis] : fmt::format("{}", direction);
    if (direction < 0 && axis < axes.size()) name[0] = '-';
    const int node = integer(entity, 41, 10, "the node");
    h.name = fmt::format("{}:{}", node, name);
    // Not every program fills these columns as it should.
    const auto or_zero = [](std::string_view text) { double value = 0; return read_fortran(text, value) && std::abs(value) < 2e9 ? static_cast<int>(value) : 0; };
    h.type = or_zero(field(entity, 0, 5));
    h.node = node;
    h.direction = direction;
    h.reference_node = or_zero(field(entity, 66, 10));
    h.reference_direction = or_zero(field(entity, 76, 4));
    const std::string_view form = line();
    h.ordinate = integer(form, 0, 10, "the type of the ordinate");
    const int points = integer(form, 10, 10, "the number of points");
    h.even = integer(form, 20, 10, "the abscissa's spacing") == 1;
    h.start = number(form, 30, 13, "the abscissa's beginning");
    h.step = number(form, 43, 13, "the abscissa's increment");
    if (h.ordinate != 2 && h.ordinate != 4 && h.ordinate != 5 && h.ordinate != 6) refuse(fmt::format("the ordinate is of the type {}", h.ordinate));
    // Every point takes four bytes at the least, in a binary file.
    if (points < 0 || static_cast<std::size_t>(points) > bytes_.size() / 4) refuse(fmt::format("{} points in a file of {} bytes", points, bytes_.size()));
    h.points = static_cast<std::size_t>(points);
    line();  // abscissa
    const std::string_view ordinate = line();
    h.unit = told(field(ordinate, 47, 20));
    if (node == 0 && direction == 0)  // as from amplifiers, which know of no structure
      for (const std::string& called : {told(h.title), told(field(ordinate, 26, 20))})
        if (!called.empty()) h.name = called;
    h.reference_unit = told(field(line(), 47, 20));  // of the denominator
    line();  // z axis
    return h;
  }

  void read_58(bool is_binary, std::string_view kind) {
    Binary binary;
    if (is_binary) {
      binary.big_endian = integer(kind, 7, 6, "the byte order") == 2;
      binary.ieee = integer(kind, 13, 6, "the floating-point format") == 2;
      const int bytes = integer(kind, 31, 12, "the number of bytes");
      if (bytes < 0 || static_cast<std::size_t>(bytes) > bytes_.size()) refuse(fmt::format("{} bytes of data in a file of {}", bytes, bytes_.size()));
      binary.bytes = static_cast<std::size_t>(bytes);
    }
    const Header h = header();
    std::vector<double> x, y;
    if (is_binary) {
      const std::string_view data = bytes_.substr(at_, binary.bytes);
      if (data.size() < binary.bytes) refuse("the file ends within the numbers of a binary dataset");
      at_ += binary.bytes;
      if (binary.ieee) read_binary(h, binary, data, x, y);
      if (at_ < bytes_.size() && bytes_[at_] != '\n' && bytes_[at_] != '\r' && bytes_[at_] != ' ') refuse("a binary dataset is longer than it says");
      while (at_ < bytes_.size() && trimmed(line()) != "-1") {
      }
      if (!binary.ieee) return leave_out(h, "its numbers are in a DEC or IBM format");
    } else {
      read_text(h, x, y);
    }
    keep_function(h, x, y);
    if (h.complex()) return leave_out(h, "its numbers are complex; of frequency response functions `unrig new rig --from impact-test` makes a rig");
    keep(h, std::move(x), std::move(y));
  }

  void leave_out(const Header& h, const char* why) { out_.warnings.push_back(fmt::format("{}:{}: the function at {} is left out: {}", out_.file, line_number_, h.name, why)); }

  void read_binary(const Header& h, const Binary& binary, std::string_view data, std::vector<double>& x, std::vector<double>& y) {
    const std::size_t wide = h.is_double() ? 8 : 4, each = h.points == 0 ? 0 : data.size() / h.points;
    // Programs differ in whether the abscissa of a double function is single or double.
    const std::size_t value = h.complex() ? 2 * wide : wide, before = h.even ? 0 : each == value + 4 ? 4 : wide;
    if (h.points > 0 && (each != before + value || data.size() % h.points != 0))
      refuse(fmt::format("{} points of {} bytes each do not make the {} bytes that the dataset counts", h.points, before + value, data.size()));
    ByteReader reader(data, binary.big_endian);
    const auto next = [&](std::size_t bytes) { return bytes == 8 ? reader.number<double>() : static_cast<double>(reader.number<float>()); };
    for (std::size_t k = 0; k < h.points; ++k) {
      if (before) x.push_back(next(before));
      for (std::size_t part = 0; part < value / wide; ++part) y.push_back(next(wide));
    }
  }

  /// Fixed columns: 13 wide for single numbers and abscissas, 20 for double ones.
  void read_text(const Header& h, std::vector<double>& x, std::vector<double>& y) {
    const std::size_t wide = h.is_double() ? 20 : 13, wanted = h.points * (h.complex() ? 2 : 1);
    std::vector<std::size_t> widths;  // of one line; the last may be shorter
    if (h.even) {
      widths.assign(h.is_double() ? 4 : 6, wide);
    } else if (h.is_double()) {
      widths = h.complex() ? std::vector<std::size_t>{13, 20, 20} : std::vector<std::size_t>{13, 20, 13, 20};
    } else {
      widths.assign(6, 13);
    }
    const std::size_t group = h.even ? 1 : h.complex() ? 3 : 2;  // an abscissa stands before each function value
    std::size_t values = 0;
    while (values < wanted) {
      const std::string_view text = line();
      if (trimmed(text) == "-1") refuse(fmt::format("a dataset ends after {} of {} numbers", values, wanted));
      std::size_t column = 0;
      for (std::size_t i = 0; i < widths.size() && values < wanted; column += widths[i++]) {
        const std::string_view cell = field(text, column, widths[i]);
        if (cell.empty()) break;
        double value = 0;
        if (!read_fortran(cell, value)) refuse(fmt::format("\"{}\" is no number", cell));
        if (!h.even && i % group == 0) {
          x.push_back(value);
        } else {
          y.push_back(value);
          ++values;
        }
      }
      if (column == 0) refuse("a line without numbers within the data");
    }
    if (!h.even && x.size() != h.points) refuse(fmt::format("{} abscissas for {} points", x.size(), h.points));
    if (trimmed(line()) != "-1") refuse("a dataset is longer than it says");
  }

  void keep_function(const Header& h, const std::vector<double>& x, const std::vector<double>& y) {
    UffFunction f{h.type, line_number_, h.node, h.direction, h.reference_node, h.reference_direction, h.name, h.unit, h.reference_unit, x, {}};
    for (std::size_t k = 0; k < h.points; ++k) {
      f.value.emplace_back(h.complex() ? std::complex<double>(y[2 * k], y[2 * k + 1]) : std::complex<double>(y[k]));
      if (h.even) f.abscissa.push_back(h.start + h.step * static_cast<double>(k));
    }
    functions_.push_back(std::move(f));
  }

  void keep(const Header& h, std::vector<double> x, std::vector<double> y) {
    const int times = ++seen_[h.name];
    const std::string name = times == 1 ? h.name : fmt::format("{}#{}", h.name, times);
    if (!h.even) out_.channels.push_back({name + " abscissa", "", std::move(x), "", 0, 0});
    out_.channels.push_back({name, h.unit, std::move(y), "", h.even && h.step > 0 ? h.step : 0, h.even ? h.start : 0});
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  int line_number_ = 0;
  std::map<std::string, int> seen_;
  std::vector<UffFunction> functions_;
  Recording out_;
};

}  // namespace

Recording read_uff(std::string_view bytes, const std::string& file) { return UffFile(bytes, file).read(); }

std::vector<UffFunction> read_uff_functions(std::string_view bytes, const std::string& file) { return UffFile(bytes, file).functions(); }

}  // namespace unrig
