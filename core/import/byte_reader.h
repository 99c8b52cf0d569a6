#pragma once
#include <bit>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>

namespace unrig {

/// The bytes ended before what should have been there.
class OutOfBytes : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Numbers out of bytes, in either byte order, never beyond the end.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes, bool big_endian = false) : bytes_(bytes), big_endian_(big_endian) {}

  bool is_big_endian() const { return big_endian_; }
  std::size_t position() const { return position_; }
  std::size_t left() const { return bytes_.size() - position_; }
  void seek(std::size_t position) {
    if (position > bytes_.size()) throw OutOfBytes("a place beyond the end of the file is referred to");
    position_ = position;
  }

  std::string_view take(std::uint64_t count) {
    if (count > left()) throw OutOfBytes("the file ends early");
    const std::string_view taken = bytes_.substr(position_, static_cast<std::size_t>(count));
    position_ += static_cast<std::size_t>(count);
    return taken;
  }

  template <class T>
  T number() {
    return number_at<T>(take(sizeof(T)).data(), big_endian_);
  }

  /// A number at any address, aligned or not.
  template <class T>
  static T number_at(const char* from, bool big_endian) {
    char bytes[sizeof(T)];
    const bool swap = big_endian != (std::endian::native == std::endian::big);
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = from[swap ? sizeof(T) - 1 - i : i];
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return value;
  }

  /// Text behind its length in 32 bits.
  std::string text() { return std::string(take(number<std::uint32_t>())); }

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;
  bool big_endian_;
};

}  // namespace unrig
