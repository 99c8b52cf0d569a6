// MATLAB files written by libmatio and h5py.

#include "core/import/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <matio.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "core/files/error.h"
#include "tests/support/complaint.h"
#include "tests/support/temporary_directory.h"

namespace unrig {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using test::TemporaryDirectory;
using test::complaint;
using Values = std::vector<double>;

void write_mat(const std::string& path, mat_ft version) {
  mat_t* file = Mat_CreateVer(path.c_str(), nullptr, version);
  ASSERT_NE(file, nullptr);
  double force[]{1, 2, 3}, matrix[]{1, 2, 3, 10, 20, 30};
  std::int16_t counts[]{7, 8, 9};
  std::size_t column[]{3, 1}, table[]{3, 2}, one[]{1, 1};
  const auto write = [&](matvar_t* v) {
    EXPECT_EQ(Mat_VarWrite(file, v, version == MAT_FT_MAT5 ? MAT_COMPRESSION_ZLIB : MAT_COMPRESSION_NONE), 0);
    Mat_VarFree(v);
  };
  write(Mat_VarCreate("force", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, column, force, 0));
  write(Mat_VarCreate("m", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, table, matrix, 0));
  write(Mat_VarCreate("counts", MAT_C_INT16, MAT_T_INT16, 2, column, counts, 0));
  const char* fields[]{"gauge"};
  matvar_t* structure = Mat_VarCreateStruct("data", 2, one, fields, 1);
  Mat_VarSetStructFieldByName(structure, "gauge", 0, Mat_VarCreate(nullptr, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, column, force, 0));
  write(structure);
  Mat_Close(file);
}

Recording recording_in(const std::string& path) { return read_recording(path, "unrig_import = 1\n", "map.toml"); }

TEST(Mat, ReadsBothVersions) {
  const TemporaryDirectory directory;
  for (const mat_ft version : {MAT_FT_MAT5, MAT_FT_MAT73}) {
    const std::string path = directory.path("lab.mat");
    write_mat(path, version);
    const Recording r = recording_in(path);
    ASSERT_EQ(r.channels.size(), 5u);
    std::map<std::string, RecordedChannel> by_name;  // HDF5 sorts them
    for (const RecordedChannel& c : r.channels) by_name[c.name] = c;
    EXPECT_EQ(by_name["force"].value, (Values{1, 2, 3}));
    EXPECT_THAT(by_name["force"].raw, IsEmpty());
    EXPECT_EQ(by_name["m(:,2)"].value, (Values{10, 20, 30}));
    EXPECT_EQ(by_name["counts"].value, (Values{7, 8, 9}));
    EXPECT_THAT(by_name["counts"].raw, HasSubstr("integers"));
    EXPECT_EQ(by_name["data.gauge"].value, (Values{1, 2, 3}));
  }
}

/// The names of the columns in a cell array, and a matrix that stands on its side.
TEST(Mat, NamesColumnsByTheListsBesideThem) {
  const TemporaryDirectory directory;
  for (const mat_ft version : {MAT_FT_MAT5, MAT_FT_MAT73}) {
    const std::string path = directory.path("names.mat");
    mat_t* file = Mat_CreateVer(path.c_str(), nullptr, version);
    ASSERT_NE(file, nullptr);
    double matrix[]{0, 10, 1, 20, 2, 30};  // 2 x 3, column by column
    std::size_t wide[]{2, 3}, two[]{1, 2};
    const auto cell = [&](const char* name, const char* first, const char* second) {
      matvar_t* list = Mat_VarCreate(name, MAT_C_CELL, MAT_T_CELL, 2, two, nullptr, 0);
      int at = 0;
      for (const char* text : {first, second}) {
        std::size_t length[]{1, std::strlen(text)};
        Mat_VarSetCell(list, at++, Mat_VarCreate(nullptr, MAT_C_CHAR, MAT_T_UTF8, 2, length, const_cast<char*>(text), 0));
      }
      return list;
    };
    for (matvar_t* v : {Mat_VarCreate("data", MAT_C_DOUBLE, MAT_T_DOUBLE, 2, wide, matrix, 0), cell("names", "angle", "load cell"), cell("units", "deg", "N")}) {
      EXPECT_EQ(Mat_VarWrite(file, v, MAT_COMPRESSION_NONE), 0);
      Mat_VarFree(v);
    }
    Mat_Close(file);
    const Recording r = recording_in(path);
    ASSERT_EQ(r.channels.size(), 2u);
    EXPECT_EQ(r.channels[0].name, "data(1,:)");
    EXPECT_EQ(r.channels[0].label, "angle");
    EXPECT_EQ(r.channels[0].unit, "deg");
    EXPECT_EQ(r.channels[0].value, (Values{0, 1, 2}));
    EXPECT_EQ(r.channels[1].label, "load cell");
    EXPECT_EQ(r.channels[1].unit, "N");
    EXPECT_EQ(r.channels[1].value, (Values{10, 20, 30}));
  }
}

/// Written by h5py 3.7 as hdf5storage does: text attributes padded with NULs, at which libmatio finds no variable. The second has no sign of MATLAB in it.
TEST(Mat, ReadsWhatH5pyWrote) {
  const auto corpus = [](const std::string& name) { return recording_in(std::string(UNRIG_SOURCE_DIR) + "/tests/fuzz/corpus/mat73/" + name); };
  std::map<std::string, RecordedChannel> by_name;
  for (const RecordedChannel& c : corpus("h5py.mat").channels) by_name[c.name] = c;
  ASSERT_EQ(by_name.size(), 5u);
  EXPECT_EQ(by_name["force"].value.size(), 40u);
  EXPECT_NEAR(by_name["force"].value[10], std::sin(1.0), 1e-15);
  EXPECT_THAT(by_name["counts"].raw, HasSubstr("integers"));
  EXPECT_EQ(by_name["rec.data(3,:)"].label, "load cell");
  EXPECT_EQ(by_name["rec.data(3,:)"].unit, "N");
  EXPECT_NEAR(by_name["rec.data(3,:)"].value[39], 7 - 0.078, 1e-15);

  by_name.clear();
  for (const RecordedChannel& c : corpus("h5py_without_matlab.h5").channels) by_name[c.name] = c;
  ASSERT_EQ(by_name.size(), 3u);
  EXPECT_EQ(by_name["gauge"].value.size(), 40u);
  EXPECT_EQ(by_name["both(:,2)"].label, "gauge");
  EXPECT_EQ(by_name["both(:,2)"].value, by_name["gauge"].value);
}

TEST(Mat, RefusesWhatCannotBeRead) {
  const TemporaryDirectory directory;
  EXPECT_THAT(complaint([&] { recording_in(directory.path("absent.mat")); }), HasSubstr("cannot be read"));
  EXPECT_THAT(complaint([&] { recording_in(directory.file("text.mat", "MATLAB is not here")); }), HasSubstr("no MATLAB file"));
  write_mat(directory.path("whole.mat"), MAT_FT_MAT5);
  const std::string whole = [&] {
    std::ifstream file(directory.path("whole.mat"), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  }();
  for (const std::size_t length : {whole.size() / 2, std::size_t(128), std::size_t(140)}) {
    const std::string path = directory.file("cut.mat", whole.substr(0, length));
    const std::string said = complaint([&] {
      const Recording r = recording_in(path);
      for (const RecordedChannel& c : r.channels) EXPECT_EQ(c.value.size(), 3u) << c.name;  // what is handed on is whole
    });
    if (length <= 140) {
      EXPECT_THAT(said, HasSubstr("no variable"));
    }
  }
}

}  // namespace
}  // namespace unrig
