#include "fit/likelihood/rest_rows.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/model/aeroelastic_model.h"
#include "core/propagate/exact_step.h"
#include "tests/support/sample_data.h"

namespace unrig::rest_rows {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd wavy(Index samples) {
  return VectorXd::NullaryExpr(samples, [](Index k) { return 3 + std::sin(0.7 * static_cast<double>(k)) + 0.3 * std::cos(0.002 * static_cast<double>(k * k)); });
}

TEST(RestRows, PolynomialsAreOrthonormal) {
  for (const Index samples : {Index{32}, stretch_samples}) {
    const MatrixXd B = orthonormal_polynomials(samples);
    EXPECT_LT((B.transpose() * B - MatrixXd::Identity(smooth_terms, smooth_terms)).norm(), 1e-13);
    const VectorXd x = VectorXd::LinSpaced(samples, -1, 1), power = x.array().pow(smooth_terms - 1);
    EXPECT_LT((power - B * (B.transpose() * power)).norm(), 1e-13 * power.norm());
  }
}

TEST(RestRows, DecaysAreSmoothOrSoonGone) {
  // Whatever the rate: what is no polynomial in the stretch, over what there was at the start of the stretches before.
  const MatrixXd B = orthonormal_polynomials(stretch_samples);
  for (const double a : {0.1, 1.0, 4.0, 8.0, 20.0}) {
    const VectorXd decay = (-a * VectorXd::LinSpaced(stretch_samples, 0, 1).array()).exp();
    const int before = a > 4 ? static_cast<int>(std::ceil(30 / a)) : 0;  // stretches
    EXPECT_LT((decay - B * (B.transpose() * decay)).norm() * std::exp(-a * before), 1e-12 * std::sqrt(static_cast<double>(stretch_samples))) << a;
  }
}

TEST(RestRows, ReadingsAreTakenApartExactly) {
  const VectorXd y = wavy(stretch_samples), a = VectorXd::LinSpaced(smooth_terms, 2, -1);
  const VectorXd model = orthonormal_polynomials(stretch_samples) * a;
  for (const bool even : {true, false}) {
    VectorXd w = VectorXd::Constant(stretch_samples, 2.5);
    if (!even) w.segment(100, 50).setZero(), w.tail(300).setConstant(0.7);
    const SmoothReadings r = smooth_readings(w, y);
    EXPECT_NEAR(((r.reading - r.weight * a).squaredNorm() + r.beside) / w.cwiseProduct(y - model).squaredNorm(), 1, 1e-12) << even;
  }
}

TEST(RestRows, SmoothResponseIsThePolynomialOfTheFreeOne) {
  Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel model(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones));
  Conditions conditions;
  conditions.density = 998.2;
  conditions.speed = 0.6;
  const LinearSystem system = model.system(conditions, model.start_values(), {"gauge"});
  const ExactStep step = exact_step(system, 0.004);
  const FreeResponse free(system, step, Partials::all);
  DualMatrix start(MatrixXd::Constant(system.states(), 1, 1e-3), static_cast<Index>(model.parameters().size()));
  start = free.from(start, 6 * stretch_samples).end;  // until only a slow decay is left
  const Response each = free.from(start, stretch_samples), few = SmoothResponse(free).from(start);
  const MatrixXd B = orthonormal_polynomials(stretch_samples);
  EXPECT_LT((each.output - B * few.output).norm(), 1e-9 * each.output.norm());
  for (std::size_t j = 0; j < each.partial.size(); ++j) {
    if (each.partial[j].size() == 0) continue;
    EXPECT_LT((each.partial[j] - B * few.partial[j]).norm(), 1e-9 * each.partial[j].norm()) << model.parameters()[j].name;
    EXPECT_LT((each.end.d(static_cast<Index>(j)) - few.end.d(static_cast<Index>(j))).norm(), 1e-9 * each.end.d(static_cast<Index>(j)).norm());
  }
  EXPECT_LT((each.end.value - few.end.value).norm(), 1e-9 * each.end.value.norm());
}

}  // namespace
}  // namespace unrig::rest_rows
