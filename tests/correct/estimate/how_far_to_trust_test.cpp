#include "correct/estimate/how_far_to_trust.h"

#include <gtest/gtest.h>

#include <cmath>

#include "correct/corrected_files.h"
#include "correct/modal/modal_load.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index rows = 5;

CorrectResult made_up_result(double reduced_chi2, std::vector<std::string> warnings) {
  CorrectResult r;
  r.dt = r.semichords_per_second = r.force_per_coefficient = 1;
  r.gauge = r.unexplained = VectorXd::Zero(rows);
  for (CorrectedLoad* load : {&r.normal_force, &r.circulatory}) {
    load->value = load->std = load->half_weight = load->twice_weight = VectorXd::Ones(rows);
    load->by_source = MatrixXd::Ones(rows, sources);
  }
  IndicialResponse& response = r.indicial;
  response.semichords = VectorXd::LinSpaced(rows, 1, rows);
  response.value = response.half_weight = response.twice_weight = response.per_radian = response.per_radian_std = response.uncertainty.std = VectorXd::Ones(rows);
  response.uncertainty.by_source = MatrixXd::Ones(rows, sources);
  r.reduced_chi2 = reduced_chi2;
  r.warnings = std::move(warnings);
  return r;
}

TEST(HowFarToTrust, TravelsWithBothTables) {
  CorrectResult r = made_up_result(50.41, {"a.csv: one, \"two\"", "a.csv: three [N]"});
  r.no_answer = "a.csv: it moves";
  for (const std::string& text : {to_csv(r), to_indicial_csv(r)}) {
    const CsvTable table = read_csv(text, 1, "table.csv");
    EXPECT_EQ(table.rows(), rows);
    const HowFarToTrust trust = HowFarToTrust::of_table(table);
    EXPECT_EQ(trust.reduced_chi2, 50.41);
    EXPECT_EQ(trust.warnings, (std::vector<std::string>{"a.csv: one; 'two'", "a.csv: three (N)"}));
    EXPECT_EQ(trust.no_answer, "a.csv: it moves");
  }
}

TEST(HowFarToTrust, WhatMadeThemIsTheLastColumnOfBothTables) {
  const MadeBy made{{"unrig 0.1.0", "unrig correct 'run #3, [a].csv'"}, "1a", "2b", "3c"};
  const CorrectResult r = made_up_result(1.02, {"run #3.csv: a warning"});
  for (const std::string& text : {to_csv(r, made), to_indicial_csv(r, made)}) {
    EXPECT_EQ(text.find('#'), std::string::npos) << "readers that skip comments would cut the header off there";
    const CsvTable table = read_csv(text, 1, "table.csv");
    EXPECT_EQ(table.columns.back().value, VectorXd::Ones(rows));
    const HowFarToTrust trust = HowFarToTrust::of_table(table);
    EXPECT_EQ(trust.made_by.provenance.program, "unrig 0.1.0");
    EXPECT_EQ(trust.made_by.provenance.command, "unrig correct 'run ?3; (a).csv'");
    EXPECT_EQ(trust.made_by.rig + trust.made_by.run + trust.made_by.fit, "1a2b3c");
  }
}

TEST(HowFarToTrust, LeavesATableOfNumbersWhereNothingIsToBeWarnedOf) {
  const CorrectResult r = made_up_result(1.02, {});
  for (const std::string& text : {to_csv(r), to_indicial_csv(r)}) {
    const CsvTable table = read_csv(text, 1, "table.csv");
    for (const CsvColumn& column : table.columns) EXPECT_EQ(column.text, "") << column.name;
    EXPECT_TRUE(HowFarToTrust::of_table(table).warnings.empty());
    EXPECT_EQ(HowFarToTrust::of_table(table).no_answer, "");
  }
  // The first line is the header that correct/manual/results.md promises.
  EXPECT_TRUE(to_csv(r).starts_with("time [s],semichords,gauge [N],normal_force [N],normal_force_std [N],circulatory [N],circulatory_std [N],cn,cn_std,"));
  EXPECT_TRUE(to_indicial_csv(r).starts_with("semichords,indicial,indicial_std,"));
}

TEST(HowFarToTrust, AModalLoadHasItsWarningsAndNoChiSquare) {
  ModalLoad r;
  r.unit = "V";
  r.dt = 1;
  r.gauge = r.from_inputs = r.load = r.std = r.half_weight = r.twice_weight = VectorXd::Ones(rows);
  r.by_source = MatrixXd::Ones(rows, sources);
  r.warnings = {"a.csv: 3 samples are missing"};
  const std::string text = to_csv(r);
  const CsvTable table = read_csv(text, 1, "table.csv");
  const HowFarToTrust trust = HowFarToTrust::of_table(table);
  EXPECT_TRUE(std::isnan(trust.reduced_chi2));
  EXPECT_EQ(trust.warnings, r.warnings);
}

}  // namespace
}  // namespace unrig
