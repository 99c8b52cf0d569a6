#pragma once
#include <string>
#include <vector>

namespace unrig {

/// One column of a laboratory's file as a reader hands it on: physical values, or counts that are marked as such.
struct RecordedChannel {
  std::string name;            ///< "group/channel", "struct.field", the header's name, "node:direction", a label
  std::string unit;            ///< as the file says; empty where it does not
  std::vector<double> value;
  std::string raw;             ///< not empty: these are unscaled converter counts, and why they could not be scaled
  double step = 0, start = 0;  ///< s: where the file gives the channel's own sampling; step 0: it does not
  std::string remark{};        ///< what else to know about it: how time stamps became seconds
  std::string label{};         ///< what the file calls it elsewhere: in a list of names beside a matrix; a mapping may name it so
};

/// A column that a text file has and that holds no numbers, or not only numbers.
struct LeftOutChannel {
  std::string name;
  int line = 0;             ///< where that shows
  std::string why, advice;  ///< "\"OK\" is no number", and what to do where it should have been read
};

/// What a reader found in a file.
struct Recording {
  std::string file;
  std::string format;  ///< "TDMS", "UFF 58", "MAT", "text"
  std::vector<RecordedChannel> channels;
  std::vector<std::string> warnings;  ///< what could not be read, and was left out
  std::vector<LeftOutChannel> left_out{};
};

}  // namespace unrig
