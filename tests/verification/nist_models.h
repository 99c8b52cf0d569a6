#pragma once
#include <ceres/jet.h>

#include <array>
#include <string>
#include <vector>

namespace unrig::test {

/// A model of the NIST Statistical Reference Datasets for nonlinear regression, as its file writes it (https://www.itl.nist.gov/div898/strd/nls/).
/// Extended precision: the residuals of Lanczos1 are 1e-13 of its data, and in double precision their rounding alone would move the residual
/// standard deviation in the fourth digit.
using NistNumber = ceres::Jet<long double, 9>;
struct NistModel {
  const char* name;
  /// y at x, with parameters b[1], b[2], ...; x is one predictor, Nelson has a second.
  NistNumber (*y)(const NistNumber* b, long double x, long double x2);
};

inline const std::vector<NistModel>& nist_models() {
  using J = NistNumber;
  using X = long double;
  constexpr X pi = 3.141592653589793238462643383279L;
  static constexpr auto gauss = [](const J* b, X x, X) {
    return b[1] * exp(-b[2] * x) + b[3] * exp(-(x - b[4]) * (x - b[4]) / (b[5] * b[5])) + b[6] * exp(-(x - b[7]) * (x - b[7]) / (b[8] * b[8]));
  };
  static constexpr auto cubics = [](const J* b, X x, X) {
    return (b[1] + b[2] * x + b[3] * (x * x) + b[4] * (x * x * x)) / (X(1) + b[5] * x + b[6] * (x * x) + b[7] * (x * x * x));
  };
  static constexpr auto lanczos = [](const J* b, X x, X) { return b[1] * exp(-b[2] * x) + b[3] * exp(-b[4] * x) + b[5] * exp(-b[6] * x); };
  static constexpr auto chwirut = [](const J* b, X x, X) { return exp(-b[1] * x) / (b[2] + b[3] * x); };
  static constexpr auto saturation = [](const J* b, X x, X) { return b[1] * (X(1) - exp(-b[2] * x)); };
  static const std::vector<NistModel> models = {
      {"Bennett5", [](const J* b, X x, X) { return b[1] * pow(b[2] + x, X(-1) / b[3]); }},
      {"BoxBOD", saturation},
      {"Chwirut1", chwirut},
      {"Chwirut2", chwirut},
      {"DanWood", [](const J* b, X x, X) { return b[1] * pow(x, b[2]); }},
      {"ENSO",
       [](const J* b, X x, X) {
         const auto turn = [&](const J& period) { return X(2) * pi * x / period; };
         return b[1] + b[2] * cos(turn(J(12))) + b[3] * sin(turn(J(12))) + b[5] * cos(turn(b[4])) + b[6] * sin(turn(b[4])) + b[8] * cos(turn(b[7])) +
                b[9] * sin(turn(b[7]));
       }},
      {"Eckerle4", [](const J* b, X x, X) { return b[1] / b[2] * exp(X(-0.5) * ((x - b[3]) / b[2]) * ((x - b[3]) / b[2])); }},
      {"Gauss1", gauss},
      {"Gauss2", gauss},
      {"Gauss3", gauss},
      {"Hahn1", cubics},
      {"Kirby2", [](const J* b, X x, X) { return (b[1] + b[2] * x + b[3] * (x * x)) / (X(1) + b[4] * x + b[5] * (x * x)); }},
      {"Lanczos1", lanczos},
      {"Lanczos2", lanczos},
      {"Lanczos3", lanczos},
      {"MGH09", [](const J* b, X x, X) { return b[1] * (x * x + x * b[2]) / (x * x + x * b[3] + b[4]); }},
      {"MGH10", [](const J* b, X x, X) { return b[1] * exp(b[2] / (x + b[3])); }},
      {"MGH17", [](const J* b, X x, X) { return b[1] + b[2] * exp(-x * b[4]) + b[3] * exp(-x * b[5]); }},
      {"Misra1a", saturation},
      {"Misra1b", [](const J* b, X x, X) { return b[1] * (X(1) - X(1) / ((X(1) + b[2] * x / X(2)) * (X(1) + b[2] * x / X(2)))); }},
      {"Misra1c", [](const J* b, X x, X) { return b[1] * (X(1) - X(1) / sqrt(X(1) + X(2) * b[2] * x)); }},
      {"Misra1d", [](const J* b, X x, X) { return b[1] * b[2] * x / (X(1) + b[2] * x); }},
      {"Nelson", [](const J* b, X x, X x2) { return b[1] - b[2] * x * exp(-b[3] * x2); }},  // of log y
      {"Rat42", [](const J* b, X x, X) { return b[1] / (X(1) + exp(b[2] - b[3] * x)); }},
      {"Rat43", [](const J* b, X x, X) { return b[1] / pow(X(1) + exp(b[2] - b[3] * x), X(1) / b[4]); }},
      {"Roszman1", [](const J* b, X x, X) { return b[1] - b[2] * x - atan(b[3] / (x - b[4])) / pi; }},
      {"Thurber", cubics},
  };
  return models;
}

}  // namespace unrig::test
