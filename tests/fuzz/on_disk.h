#pragma once
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <string>

/// The bytes under a path, in memory only, for readers that open files themselves.
class OnDisk {
 public:
  OnDisk(const std::uint8_t* data, std::size_t size) : file_(memfd_create("fuzz", 0)) {
    if (write(file_, data, size) < 0) _exit(1);
  }
  ~OnDisk() { close(file_); }
  OnDisk(const OnDisk&) = delete;
  OnDisk& operator=(const OnDisk&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  int file_;
};
