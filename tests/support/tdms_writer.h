#pragma once
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace unrig::test {

/// TDMS bytes for tests, written from NI's description of the format and sharing no code with the reader.
class TdmsBytes {
 public:
  explicit TdmsBytes(bool big_endian = false) : big_(big_endian) {}

  template <class T>
  TdmsBytes& number(T value) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    for (std::size_t i = 0; i < sizeof(T); ++i) text_ += bytes[big_ ? sizeof(T) - 1 - i : i];
    return *this;
  }
  TdmsBytes& text(const std::string& s) {
    number<std::uint32_t>(static_cast<std::uint32_t>(s.size()));
    text_ += s;
    return *this;
  }
  TdmsBytes& raw(const std::string& s) {
    text_ += s;
    return *this;
  }
  const std::string& bytes() const { return text_; }

 private:
  bool big_;
  std::string text_;
};

using TdmsProperty = std::pair<std::string, std::variant<double, std::int32_t, std::string>>;

/// One object's part of the meta data: path, its index of the data as bytes, properties.
struct TdmsObject {
  std::string path;
  std::string index;
  std::vector<TdmsProperty> properties = {};
};

inline std::string no_data(bool big = false) { return TdmsBytes(big).number<std::uint32_t>(0xFFFFFFFF).bytes(); }
inline std::string same_data(bool big = false) { return TdmsBytes(big).number<std::uint32_t>(0).bytes(); }
inline std::string plain_data(std::uint32_t type, std::uint64_t count, bool big = false) {
  return TdmsBytes(big).number<std::uint32_t>(20).number(type).number<std::uint32_t>(1).number(count).bytes();
}
struct TdmsScaler {
  std::uint32_t type, buffer, offset, id;
};
inline std::string daqmx_data(std::uint64_t count, const std::vector<TdmsScaler>& scalers, const std::vector<std::uint32_t>& widths) {
  TdmsBytes out;
  out.number<std::uint32_t>(0x1269).number<std::uint32_t>(0xFFFFFFFF).number<std::uint32_t>(1).number(count).number(static_cast<std::uint32_t>(scalers.size()));
  for (const TdmsScaler& s : scalers) out.number(s.type).number(s.buffer).number(s.offset).number<std::uint32_t>(0).number(s.id);
  out.number(static_cast<std::uint32_t>(widths.size()));
  for (const std::uint32_t w : widths) out.number(w);
  return out.bytes();
}

enum : std::uint32_t { toc_meta = 2, toc_new = 4, toc_raw = 8, toc_interleaved = 32, toc_big = 64, toc_daqmx = 128 };

/// A segment; `toc` without the bits that follow from the rest.
inline std::string tdms_segment(std::uint32_t toc, const std::vector<TdmsObject>& objects, const std::string& data) {
  const bool big = toc & toc_big;
  TdmsBytes meta(big);
  if (!objects.empty()) meta.number(static_cast<std::uint32_t>(objects.size()));
  for (const TdmsObject& o : objects) {
    meta.text(o.path).raw(o.index).number(static_cast<std::uint32_t>(o.properties.size()));
    for (const auto& [name, value] : o.properties) {
      meta.text(name);
      if (const auto* d = std::get_if<double>(&value)) meta.number<std::uint32_t>(10).number(*d);
      if (const auto* i = std::get_if<std::int32_t>(&value)) meta.number<std::uint32_t>(3).number(*i);
      if (const auto* s = std::get_if<std::string>(&value)) meta.number<std::uint32_t>(0x20).text(*s);
    }
  }
  if (!objects.empty()) toc |= toc_meta;
  if (!data.empty()) toc |= toc_raw;
  TdmsBytes out(big);
  out.raw("TDSm").raw(TdmsBytes().number(toc).bytes()).number<std::uint32_t>(4713);
  out.number<std::uint64_t>(meta.bytes().size() + data.size()).number<std::uint64_t>(meta.bytes().size());
  return out.raw(meta.bytes()).raw(data).bytes();
}

template <class T>
std::string values(const std::vector<T>& numbers, bool big = false) {
  TdmsBytes out(big);
  for (const T x : numbers) out.number(x);
  return out.bytes();
}

}  // namespace unrig::test
