#include "core/import/tdms.h"

#include <algorithm>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/import/byte_reader.h"
#include "core/import/tdms_scaling.h"

namespace unrig {
namespace {

using u32 = std::uint32_t;
using u64 = std::uint64_t;

enum Toc : u32 { toc_meta_data = 1 << 1, toc_new_objects = 1 << 2, toc_raw_data = 1 << 3, toc_interleaved = 1 << 5, toc_big_endian = 1 << 6, toc_daqmx = 1 << 7 };
constexpr u64 lead_in_bytes = 28, unknown_length = std::numeric_limits<u64>::max();

struct DataType {
  u32 bytes = 0;  ///< 0: of no fixed size
  double (*read)(const char*, bool big_endian) = nullptr;  ///< null: no real number
  bool integer = false;
};

template <class T>
double read_as(const char* from, bool big_endian) {
  return static_cast<double>(ByteReader::number_at<T>(from, big_endian));
}

template <class T>
constexpr DataType real() {
  return {sizeof(T), read_as<T>, std::numeric_limits<T>::is_integer};
}

DataType type_of(u32 code) {
  switch (code) {
    case 1: return real<std::int8_t>();
    case 2: return real<std::int16_t>();
    case 3: return real<std::int32_t>();
    case 4: return real<std::int64_t>();
    case 5: return real<std::uint8_t>();
    case 6: return real<std::uint16_t>();
    case 7: return real<std::uint32_t>();
    case 8: return real<std::uint64_t>();
    case 9:
    case 0x19: return real<float>();
    case 10:
    case 0x1A: return real<double>();
    case 0x21: return {1, nullptr, false};   // boolean
    case 0x44: return {16, nullptr, false};  // time stamp
    case 0x08000c: return {8, nullptr, false};
    case 0x10000d: return {16, nullptr, false};
    default: return {};
  }
}

/// Raw scalers number their types in their own way.
DataType daqmx_type(u32 code) {
  constexpr u32 ordinary[] = {5, 1, 6, 2, 7, 3};
  return code < 6 ? type_of(ordinary[code]) : DataType{};
}

/// One reading within the rows of a DAQmx buffer.
struct Scaler {
  DataType type;
  u32 buffer = 0, offset = 0, id = 0;
};

/// What a segment says of an object's data.
struct RawIndex {
  bool has_data = false;
  u32 type_code = 0;
  DataType type;
  u64 count = 0;  ///< values per chunk
  u64 bytes = 0;  ///< per chunk
  std::vector<Scaler> scalers;    ///< DAQmx
  std::vector<u32> row_widths;  ///< of the DAQmx buffers
};

struct Object {
  std::string path;
  TdmsProperties properties;
  RawIndex index;
  std::map<u32, std::vector<double>> readings;
  bool integers = false, unreadable = false;
};

/// "/'group'/'channel'" -> {"group", "channel"}; a quote within a name is doubled.
std::vector<std::string> parts_of(const std::string& path) {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at < path.size();) {
    if (path[at] != '\'') {
      ++at;
      continue;
    }
    std::string part;
    for (++at; at < path.size(); ++at) {
      if (path[at] == '\'' && !(at + 1 < path.size() && path[at + 1] == '\'')) break;
      if (path[at] == '\'') ++at;
      part += path[at];
    }
    ++at;
    parts.push_back(part);
  }
  return parts;
}

class TdmsFile {
 public:
  TdmsFile(std::string_view bytes, const std::string& file) : bytes_(bytes), file_(file) {}

  Recording read() {
    std::size_t position = 0;
    while (position < bytes_.size()) {
      try {
        position = read_segment(position);
      } catch (const OutOfBytes& e) {
        if (position == 0) refuse(0, e.what());
        warnings_.push_back(fmt::format("{}: {} within the segment at byte {}; what came before is kept", file_, e.what(), position));
        break;
      }
    }
    return recording();
  }

 private:
  [[noreturn]] void refuse(u64 position, const std::string& what) const {
    throw InputError({file_, 0}, fmt::format("{} (byte {})", what, position), "wanted a TDMS file of LabVIEW or NI-DAQmx", "Copy it again, or export it once more.");
  }

  std::size_t read_segment(std::size_t position) {
    ByteReader lead(bytes_.substr(position));
    if (lead.take(4) != "TDSm") refuse(position, "no segment begins here with \"TDSm\"");
    const u32 toc = lead.number<u32>();
    const bool big = toc & toc_big_endian;
    ByteReader reader(bytes_, big);
    reader.seek(position + 8);
    if (const u32 version = reader.number<u32>(); version != 4712 && version != 4713) refuse(position, fmt::format("the version of the format is {}", version));
    const u64 next = reader.number<u64>(), data = reader.number<u64>();
    const u64 room = bytes_.size() - position - lead_in_bytes;
    const bool cut = next == unknown_length || next > room;
    if (cut && next != unknown_length) warnings_.push_back(fmt::format("{}: the file ends within the segment at byte {}", file_, position));
    const u64 length = cut ? room : next;
    if (data > length) {
      if (cut) throw OutOfBytes("the file ends");
      refuse(position, "the data of a segment begin behind its end");
    }
    if (toc & toc_meta_data) read_meta_data(reader, toc & toc_new_objects);
    const std::size_t first = position + lead_in_bytes + static_cast<std::size_t>(data);
    if (toc & toc_raw_data) read_data(bytes_.substr(first, static_cast<std::size_t>(length - data)), toc, big);
    return position + lead_in_bytes + static_cast<std::size_t>(length);
  }

  Object& object(const std::string& path) {
    const auto found = by_path_.find(path);
    if (found != by_path_.end()) return objects_[found->second];
    by_path_[path] = objects_.size();
    return objects_.emplace_back(Object{path, {}, {}, {}});
  }

  void read_meta_data(ByteReader& reader, bool new_objects) {
    if (new_objects) order_.clear();
    const u32 count = reader.number<u32>();
    for (u32 i = 0; i < count; ++i) {
      const std::string path = reader.text();
      Object& o = object(path);
      read_index(reader, o);
      const u32 properties = reader.number<u32>();
      for (u32 p = 0; p < properties; ++p) read_property(reader, o.properties);
      const std::size_t number = by_path_[path];
      if (std::find(order_.begin(), order_.end(), number) == order_.end()) order_.push_back(number);
    }
  }

  void read_index(ByteReader& reader, Object& o) {
    const std::size_t at = reader.position();
    const u32 header = reader.number<u32>();
    if (header == 0) return;  // as in the segment before
    o.index = {};
    if (header == 0xFFFFFFFF) return;
    o.index.has_data = true;
    o.index.type_code = reader.number<u32>();
    if (reader.number<u32>() != 1) refuse(at, "an array of more than one dimension");
    o.index.count = reader.number<u64>();
    if (header == 0x126A) refuse(at, "the channel " + o.path + " holds lines of a digital port, which are not read here");
    if (header == 0x1269) return read_scalers(reader, o);
    o.index.type = type_of(o.index.type_code);
    if (o.index.type_code == 0x20)
      o.index.bytes = reader.number<u64>();
    else if (o.index.type.bytes == 0)
      refuse(at, fmt::format("the channel {} is of the unknown type {:#x}", o.path, o.index.type_code));
    else if (o.index.count > bytes_.size())  // a chunk is never longer than the file
      refuse(at, fmt::format("the channel {} counts {} values in a file of {} bytes", o.path, o.index.count, bytes_.size()));
    else
      o.index.bytes = o.index.count * o.index.type.bytes;
    if (o.index.bytes > bytes_.size() * 16) refuse(at, "a channel is longer than the file");
  }

  void read_scalers(ByteReader& reader, Object& o) {
    const std::size_t at = reader.position();
    const u32 scalers = reader.number<u32>();
    for (u32 s = 0; s < scalers; ++s) {
      const u32 type = reader.number<u32>();
      Scaler scaler{daqmx_type(type), reader.number<u32>(), reader.number<u32>(), 0};
      reader.number<u32>();  // sample format
      scaler.id = reader.number<u32>();
      if (!scaler.type.read) refuse(at, fmt::format("the channel {} has raw data of the unknown type {}", o.path, type));
      if (scaler.id == no_scaler) refuse(at, "a raw scaler has no number");
      o.index.scalers.push_back(scaler);
    }
    const u32 widths = reader.number<u32>();
    for (u32 w = 0; w < widths; ++w) o.index.row_widths.push_back(reader.number<u32>());
    if (o.index.scalers.empty()) refuse(at, "a DAQmx channel without a raw scaler");
    for (const Scaler& s : o.index.scalers)
      if (s.buffer >= widths || s.offset > o.index.row_widths[s.buffer] || o.index.row_widths[s.buffer] - s.offset < s.type.bytes)
        refuse(at, "a raw scaler of the channel " + o.path + " lies outside of its row");
    if (o.index.count > bytes_.size()) refuse(at, "a DAQmx channel counts more rows than the file has bytes");
  }

  void read_property(ByteReader& reader, TdmsProperties& properties) {
    const std::string name = reader.text();
    const std::size_t at = reader.position();
    const u32 code = reader.number<u32>();
    if (code == 0x20) {
      properties[name] = reader.text();
    } else if (code == 0x21) {
      properties[name] = static_cast<double>(reader.number<std::uint8_t>());
    } else if (code == 0x44) {
      reader.take(16);  // a date; nothing here needs it
    } else {
      const DataType type = type_of(code);
      if (type.bytes == 0) refuse(at, fmt::format("the property \"{}\" is of the unknown type {:#x}", name, code));
      const std::string_view bytes = reader.take(type.bytes);
      if (type.read) properties[name] = type.read(bytes.data(), reader.is_big_endian());
    }
  }

  void read_data(std::string_view data, u32 toc, bool big) {
    std::vector<Object*> channels;
    for (const std::size_t i : order_)
      if (objects_[i].index.has_data) channels.push_back(&objects_[i]);
    if (channels.empty()) return;
    const bool daqmx = !channels.front()->index.scalers.empty();
    for (const Object* c : channels)
      if (c->index.scalers.empty() == daqmx) refuse(0, "a segment mixes DAQmx channels with others");
    if (daqmx) return read_daqmx(data, channels, big);
    if (toc & toc_interleaved) return read_interleaved(data, channels, big);
    read_contiguous(data, channels, big);
  }

  void append(Object& o, const char* from, u64 count, u64 stride, bool big) {
    if (!o.index.type.read) {
      o.unreadable = true;
      return;
    }
    o.integers = o.index.type.integer;
    std::vector<double>& values = o.readings[no_scaler];
    for (u64 k = 0; k < count; ++k) values.push_back(o.index.type.read(from + k * stride, big));
  }

  void read_contiguous(std::string_view data, const std::vector<Object*>& channels, bool big) {
    u64 chunk = 0;
    for (const Object* c : channels) chunk += c->index.bytes;
    if (chunk == 0) return;
    std::size_t at = 0;
    for (; data.size() - at >= chunk;)
      for (Object* c : channels) {
        append(*c, data.data() + at, c->index.count, c->index.type.bytes, big);
        at += static_cast<std::size_t>(c->index.bytes);
      }
    const u64 rest = data.size() - at;
    if (rest == 0) return;
    const bool alone = channels.size() == 1 && channels.front()->index.type.bytes > 0;
    if (alone) append(*channels.front(), data.data() + at, rest / channels.front()->index.type.bytes, channels.front()->index.type.bytes, big);
    warnings_.push_back(fmt::format("{}: a chunk is cut off after {} of {} bytes; {}", file_, rest, chunk, alone ? "its whole samples are kept" : "it is left out, its channels would not be equally long"));
  }

  void read_interleaved(std::string_view data, const std::vector<Object*>& channels, bool big) {
    u64 row = 0;
    for (const Object* c : channels) {
      if (c->index.type.bytes == 0) refuse(0, "interleaved channels of variable size");
      row += c->index.type.bytes;
    }
    const u64 rows = data.size() / row;
    if (data.size() % row) warnings_.push_back(fmt::format("{}: a row of interleaved samples is cut off", file_));
    u64 offset = 0;
    for (Object* c : channels) {
      append(*c, data.data() + offset, rows, row, big);
      offset += c->index.type.bytes;
    }
  }

  /// Chunks of `count` rows; within a chunk one buffer after the other, each row by row.
  void read_daqmx(std::string_view data, const std::vector<Object*>& channels, bool big) {
    const RawIndex& first = channels.front()->index;
    u64 row = 0;
    for (const u32 width : first.row_widths) row += width;
    for (const Object* c : channels)
      if (c->index.row_widths != first.row_widths || c->index.count != first.count) refuse(0, "DAQmx channels of one segment differ in their rows");
    if (row == 0 || first.count == 0) return;
    u64 read = 0;
    for (const Object* c : channels)
      for (const Scaler& s : c->index.scalers) read += s.type.bytes;
    if (read > 8 * row) refuse(0, "the channels of a DAQmx segment overlap");  // lines of a port may share a byte; no more
    const bool one_buffer = first.row_widths.size() == 1;
    for (std::size_t at = 0; at < data.size();) {
      const u64 whole = (data.size() - at) / row, rows = std::min(first.count, whole);
      if (rows < first.count) {
        warnings_.push_back(fmt::format("{}: a chunk of DAQmx data is cut off after {} of {} rows{}", file_, rows, first.count, one_buffer ? "" : " and left out"));
        if (!one_buffer) return;  // where the next buffer begins is not known then
      }
      for (Object* c : channels) take_rows(*c, data.data() + at, rows, big);
      at += static_cast<std::size_t>(rows * row);
      if (rows < first.count) return;
    }
  }

  static void take_rows(Object& o, const char* chunk, u64 rows, bool big) {
    o.integers = true;
    for (const Scaler& s : o.index.scalers) {
      u64 begin = 0;
      for (u32 b = 0; b < s.buffer; ++b) begin += o.index.count * o.index.row_widths[b];
      const u64 width = o.index.row_widths[s.buffer];
      std::vector<double>& values = o.readings[s.id];
      for (u64 k = 0; k < rows; ++k) values.push_back(s.type.read(chunk + begin + k * width + s.offset, big));
    }
  }

  /// The channel's properties over those of its group over those of the file.
  TdmsProperties inherited(const Object& channel) const {
    TdmsProperties all = channel.properties;
    const std::size_t end = channel.path.rfind("/'");
    for (const std::string& path : {channel.path.substr(0, end == std::string::npos ? 0 : end), std::string("/")})
      if (const auto found = by_path_.find(path); found != by_path_.end() && !number_in(all, "NI_Number_Of_Scales"))
        for (const auto& [name, value] : objects_[found->second].properties)
          if (name.starts_with("NI_")) all.emplace(name, value);
    return all;
  }

  Recording recording() {
    Recording out{file_, "TDMS", {}, warnings_};
    for (Object& o : objects_) {
      const std::vector<std::string> parts = parts_of(o.path);
      if (o.unreadable) out.warnings.push_back(fmt::format("{}: the channel {} holds no real numbers and is left out", file_, o.path));
      if (parts.size() < 2 || o.unreadable || o.readings.empty()) continue;
      RecordedChannel channel{parts[0] + "/" + parts[1], "", {}, "", 0, 0};
      const TdmsProperties properties = inherited(o);
      for (const char* name : {"unit_string", "NI_UnitDescription"})
        if (const std::string* unit = text_in(properties, name); unit && channel.unit.empty()) channel.unit = *unit;
      if (const double* step = number_in(properties, "wf_increment"); step && *step > 0) channel.step = *step;
      if (const double* start = number_in(properties, "wf_start_offset")) channel.start = *start;
      TdmsScaled values = scaled(properties, std::move(o.readings), o.integers);
      channel.value = std::move(values.value);
      channel.raw = values.raw;
      out.channels.push_back(std::move(channel));
    }
    if (out.channels.empty()) refuse(bytes_.size(), "the file holds no channel with numbers");
    return out;
  }

  std::string_view bytes_;
  std::string file_;
  std::vector<Object> objects_;
  std::map<std::string, std::size_t> by_path_;
  std::vector<std::size_t> order_;  ///< objects of the present segment, in the order of their data
  std::vector<std::string> warnings_;
};

}  // namespace

Recording read_tdms(std::string_view bytes, const std::string& file) {
  if (bytes.empty()) throw InputError({file, 0}, "the file is empty", "wanted a TDMS file", "");
  return TdmsFile(bytes, file).read();
}

}  // namespace unrig
