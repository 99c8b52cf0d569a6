#include "core/import/mat5.h"

#include <zlib.h>

#include <cstdint>
#include <optional>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/import/byte_reader.h"
#include "core/import/matlab_matrix.h"

namespace unrig {
namespace {

using u32 = std::uint32_t;

enum Type : u32 { type_matrix = 14, type_packed = 15, type_utf8 = 16, type_utf16 = 17 };
enum Class : u32 { class_cell = 1, class_structure = 2, class_object = 3, class_text = 4, class_double = 6, class_single = 7, class_last_number = 15, class_opaque = 17 };
constexpr u32 flag_complex = 0x800;

struct Element {
  u32 type = 0;
  std::string_view data;
};

Element next_element(ByteReader& from) {
  const u32 tag = from.number<u32>();
  if (tag >> 16 != 0) {  // up to four bytes of data stand within the tag
    const std::string_view data = from.take(4);
    return {tag & 0xffff, data.substr(0, tag >> 16)};
  }
  const u32 bytes = from.number<u32>();
  const Element element{tag, from.take(bytes)};
  if (tag != type_packed) from.take(std::min<std::size_t>((8 - bytes % 8) % 8, from.left()));  // padding, left out at the end of some files
  return element;
}

template <class T>
std::vector<double> as_numbers(std::string_view data, bool big_endian) {
  std::vector<double> numbers(data.size() / sizeof(T));
  for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] = static_cast<double>(ByteReader::number_at<T>(data.data() + k * sizeof(T), big_endian));
  return numbers;
}

/// Numbers may be stored in a smaller type than their class: doubles that are whole numbers as bytes, for one.
std::vector<double> stored_numbers(const Element& element, bool big_endian) {
  switch (element.type) {
    case 1: return as_numbers<std::int8_t>(element.data, big_endian);
    case 2: return as_numbers<std::uint8_t>(element.data, big_endian);
    case 3: return as_numbers<std::int16_t>(element.data, big_endian);
    case 4: return as_numbers<std::uint16_t>(element.data, big_endian);
    case 5: return as_numbers<std::int32_t>(element.data, big_endian);
    case 6: return as_numbers<std::uint32_t>(element.data, big_endian);
    case 7: return as_numbers<float>(element.data, big_endian);
    case 9: return as_numbers<double>(element.data, big_endian);
    case 12: return as_numbers<std::int64_t>(element.data, big_endian);
    case 13: return as_numbers<std::uint64_t>(element.data, big_endian);
    default: return {};
  }
}

/// What a zlib stream holds. Throws OutOfBytes where it does not come to its end.
std::string unpacked(std::string_view packed) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
  struct End {
    z_stream& stream;
    ~End() { inflateEnd(&stream); }
  } const end{stream};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));  // zlib does not write there
  stream.avail_in = static_cast<uInt>(packed.size());
  std::string out;
  int status = Z_OK;
  while (status == Z_OK) {
    const std::size_t had = out.size();
    out.resize(std::max<std::size_t>(2 * had, std::size_t{1} << 12));
    const auto room = static_cast<uInt>(std::min<std::size_t>(out.size() - had, std::size_t{1} << 30));
    stream.next_out = reinterpret_cast<Bytef*>(out.data() + had);
    stream.avail_out = room;
    status = inflate(&stream, Z_NO_FLUSH);
    out.resize(had + room - stream.avail_out);
  }
  if (status != Z_STREAM_END) throw OutOfBytes("its packed data are damaged");
  return out;
}

class Mat5File {
 public:
  Mat5File(std::string_view bytes, const std::string& file) : bytes_(bytes), out_{file, "MAT", {}, {}} {}

  Recording read() {
    constexpr std::size_t head = 128, version_at = 124, order_at = 126;
    const std::string_view order = bytes_.size() < head ? "" : bytes_.substr(order_at, 2);
    if (order != "IM" && order != "MI") refuse("this is no MATLAB file of version 5");
    ByteReader file(bytes_, order == "MI");
    file.seek(version_at);
    if (file.number<std::uint16_t>() != 0x100) refuse("this is no MATLAB file of version 5");
    file.seek(head);
    while (file.left() >= 8) {
      name_.clear();
      try {
        top_element(next_element(file), file.is_big_endian());
      } catch (const OutOfBytes& e) {
        leave_out(name_.empty() ? "at the end" : name_, e.what(), out_);
      }
    }
    if (out_.channels.empty()) refuse("the file holds no variable with real numbers");
    name_columns(texts_, out_);
    return std::move(out_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError({out_.file, 0}, what, "wanted a MATLAB file of version 5 or 7.3", "Save it again with `save(..., '-v7')`.");
  }

  void top_element(const Element& element, bool big_endian) {
    if (element.type == type_matrix) return matrix(ByteReader(element.data, big_endian), "", 0);
    if (element.type != type_packed) return;
    const std::string held = unpacked(element.data);
    ByteReader inside(held, big_endian);
    const Element packed = next_element(inside);
    if (packed.type == type_matrix) matrix(ByteReader(packed.data, big_endian), "", 0);
  }

  /// One variable; within a structure its name is given, and its own is empty.
  void matrix(ByteReader from, const std::string& given_name, int depth) {
    if (!given_name.empty() && from.left() == 0) return leave_out(given_name, "it is empty", out_);
    const Element flag_element = next_element(from);
    if (flag_element.data.size() < 4) throw OutOfBytes("it does not say what it is");
    const u32 flags = ByteReader::number_at<u32>(flag_element.data.data(), from.is_big_endian()), kind = flags & 0xff;
    const std::vector<double> size_given = kind == class_opaque ? std::vector<double>{} : as_numbers<std::int32_t>(next_element(from).data, from.is_big_endian());
    const std::string_view own_name = next_element(from).data;
    const std::string name = given_name.empty() ? std::string(own_name.substr(0, own_name.find('\0'))) : given_name;
    if (depth == 0) name_ = name;
    if (name.empty()) return;  // what MATLAB keeps beside the variables for objects
    if (depth > deepest_structure) return leave_out(name, "its structures are nested more than eight deep", out_);
    std::vector<std::size_t> size;
    for (const double n : size_given) {
      if (n < 0) return leave_out(name, "its size is negative", out_);
      size.push_back(static_cast<std::size_t>(n));
    }
    if (kind == class_structure || kind == class_object) return structure(from, name, size, kind == class_object, depth);
    if (kind == class_cell) return cell(from, name);
    if (kind < class_double || kind > class_last_number) return leave_out(name, "it holds no numbers", out_);
    if ((flags & flag_complex) != 0) return leave_out(name, "its numbers are complex", out_);
    add_matrix(name, size, kind != class_double && kind != class_single, stored_numbers(next_element(from), from.is_big_endian()), out_);
  }

  void structure(ByteReader& from, const std::string& name, const std::vector<std::size_t>& size, bool object, int depth) {
    std::size_t elements = 1;
    for (const std::size_t n : size) {
      elements *= n;
      if (elements > most_structures) return leave_out(name, fmt::format("it is an array of more than {} structures", most_structures), out_);
    }
    if (object) next_element(from);  // the name of its class
    const std::vector<double> width = as_numbers<std::int32_t>(next_element(from).data, from.is_big_endian());
    const std::string_view names = next_element(from).data;
    if (width.size() != 1 || width[0] < 1) throw OutOfBytes("its fields have no names");
    const std::size_t bytes = static_cast<std::size_t>(width[0]), fields = names.size() / bytes;
    for (std::size_t e = 0; e < elements; ++e)
      for (std::size_t f = 0; f < fields; ++f) {
        const std::string_view field = names.substr(f * bytes, bytes);
        const Element held = next_element(from);
        if (held.type != type_matrix) throw OutOfBytes("its fields are damaged");
        matrix(ByteReader(held.data, from.is_big_endian()), field_name(name, e, elements, std::string(field.substr(0, field.find('\0')))), depth + 1);
      }
  }

  /// Kept where it holds texts only.
  void cell(ByteReader& from, const std::string& name) {
    std::vector<std::string> texts;
    while (from.left() >= 8 && texts.size() < most_structures) {
      const Element held = next_element(from);
      const std::optional<std::string> text = held.type == type_matrix ? text_in(ByteReader(held.data, from.is_big_endian())) : std::nullopt;
      if (!text) return leave_out(name, "it holds no numbers", out_);
      texts.push_back(*text);
    }
    texts_.push_back({name, std::move(texts)});
  }

  static std::optional<std::string> text_in(ByteReader from) {
    if (from.left() == 0) return "";
    const Element flags = next_element(from);
    if (flags.data.size() < 4 || (ByteReader::number_at<u32>(flags.data.data(), from.is_big_endian()) & 0xff) != class_text) return std::nullopt;
    next_element(from);  // its size
    next_element(from);  // its name
    const Element letters = next_element(from);
    if (letters.type == type_utf8) return std::string(letters.data);
    std::vector<std::uint16_t> units;
    for (const double unit : stored_numbers({letters.type == type_utf16 ? 4u : letters.type, letters.data}, from.is_big_endian())) units.push_back(static_cast<std::uint16_t>(static_cast<std::int64_t>(unit) & 0xffff));
    return text_of_units(units);
  }

  std::string_view bytes_;
  Recording out_;
  std::vector<NamedTexts> texts_;
  std::string name_;  ///< of the variable that is being read
};

}  // namespace

Recording read_mat5(std::string_view bytes, const std::string& file) { return Mat5File(bytes, file).read(); }

}  // namespace unrig
