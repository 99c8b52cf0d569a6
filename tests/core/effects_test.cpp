// The table of effects: what each makes of the equations of a rig, whatever their sizes. Nothing here knows an effect by its id, but where a law or a limit is its own.

#include "core/effects/effect.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "core/effects/process_noise.h"
#include "core/propagate/feedback_force.h"
#include "core/rig/rig.h"
#include "core/rig/structure.h"
#include "core/model/wagner.h"
#include "tests/core/effects/effect_cases.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;
using namespace effect_cases;
using testing::HasSubstr;
using testing::IsEmpty;

/// Parameters at which nothing of an effect vanishes: where it is absent half of the product rule would go untested.
VectorXd at_work(const AeroelasticModel& model, const Effect& e) {
  std::mt19937_64 random(11);
  VectorXd theta = model.start_values();
  const std::vector<Parameter>& own = e.parameters_on(model.rig());
  auto values = theta.tail(static_cast<Index>(own.size()));
  if (e.draw && !model.rig().is_modal()) values = e.draw(model, 20, random);
  for (double& p : values)
    if (p == 0 || p == 1) p = std::abs(p - 0.3);
  return theta;
}

/// Slope of f at 0 by central differences over h and h/2, their errors of second order cancelled (Richardson).
template <class F>
auto slope_of(const F& f, double h) {
  using Value = decltype(f(h));
  const auto difference = [&](double by) -> Value { return (f(by) - f(-by)) / (2 * by); };
  const Value coarse = difference(h), fine = difference(h / 2);
  return Value((4 * fine - coarse) / 3);
}

constexpr double step = 1e-3;        // of the argument: what Richardson leaves is of its fourth power
constexpr double relative = 1e-7;    // some thousand times that
constexpr double round_off = 1e-12;  // of what is differentiated: a hundred times 2^-53, through the solution with the mass matrix

/// Every entry by itself, beside the largest of its row: a norm would hide a small one that is wrong.
void expect_slope(const MatrixXd& exact, const MatrixXd& slope, const MatrixXd& value, double h, const std::string& what) {
  ASSERT_TRUE(exact.allFinite()) << what;
  for (Index i = 0; i < exact.rows(); ++i)
    for (Index k = 0; k < exact.cols(); ++k) {
      const double hidden = round_off * value.row(i).cwiseAbs().maxCoeff() / h;
      EXPECT_NEAR(exact(i, k), slope(i, k), relative * std::abs(slope(i, k)) + hidden) << what << " at " << i << ", " << k;
    }
}

void expect_partials(const AeroelasticModel& model, const VectorXd& theta, const std::string& id) {
  const Rig& rig = model.rig();
  const Conditions conditions = conditions_for(rig);
  const std::vector<std::string> channels = rig.is_modal() ? std::vector<std::string>{"gauge"} : std::vector<std::string>{"gauge", "twist"};
  const LinearSystem at = model.system(conditions, theta, channels);
  struct {
    const char* name;
    DualMatrix LinearSystem::*matrix;
  } const matrices[] = {{"A", &LinearSystem::A}, {"B", &LinearSystem::B}, {"C", &LinearSystem::C}, {"D", &LinearSystem::D}};
  for (const auto& [name, matrix] : matrices)
    for (Index j = 0; j < theta.size(); ++j) {
      const double h = step * (theta[j] == 0 ? 1 : std::abs(theta[j]));
      const auto value = [&](double by) -> MatrixXd {
        VectorXd there = theta;
        there[j] += by;
        return (model.system(conditions, there, channels).*matrix).value;
      };
      const DualMatrix& here = at.*matrix;
      const MatrixXd slope = slope_of(value, h);
      const MatrixXd exact = here.depends_on(j) ? here.d(j) : MatrixXd::Zero(slope.rows(), slope.cols());
      expect_slope(exact, slope, here.value, h, id + (rig.is_modal() ? " on modes: " : ": ") + name + " by " + model.parameters()[static_cast<std::size_t>(j)].name);
    }
}

TEST(Effects, PartialsOfEveryMatrixAgreeWithSlopes) {
  for (const auto& [e, rig] : cases()) {
    const AeroelasticModel model = model_with(rig, e->id);
    expect_partials(model, at_work(model, *e), e->id);
  }
}

/// What changes the build-up of circulation, where its amplitudes are parameters; and all of these effects beside each other and a carriage that shakes.
TEST(Effects, PartialsAgreeWithSlopesWhereTheBuildUpIsFree) {
  const AeroelasticModel free(beam(), make_basis(beam(), Index{3}, Index{1}), wagner(Wagner::jones), AeroelasticModel::Circulation::free);
  for (const std::vector<std::string>& ids : {std::vector<std::string>{"wagner-lag"}, {"separation-lag"}, {"carriage-vibration", "wagner-lag", "separation-lag"}, {"separation-lag", "wagner-lag"}}) {
    const AeroelasticModel model = free.with_effects(ids);
    VectorXd theta = model.start_values();
    for (double& p : theta)
      if (p == 0 || p == 1) p = 0.7;
    expect_partials(model, theta, ids.front());
  }
}

/// Circulatory load of a rigid rig, as a share of what Wagner's ends at, s semichords after a step of the downwash: of the normal and the torsional mode and of the gauge.
VectorXd built_up(const AeroelasticModel& model, const VectorXd& theta, double s) {
  const Conditions c = conditions_for(beam());
  const AeroelasticModel bare(model.rig(), model.basis(), model.circulation());
  const auto loads = [&](const AeroelasticModel& m, const VectorXd& at, bool ended) -> VectorXd {
    const LinearSystem system = m.system(c, at, {"gauge"});
    const Index n = system.coordinates, first = 2 * n, others = system.states() - first;
    VectorXd x = VectorXd::Zero(others);
    x[system.motion - first] = 1;  // a twist of the shaft, held: w = U
    const MatrixXd rates = system.A.value.bottomRightCorner(others, others);
    if (ended) x.head(system.lags).setConstant(c.speed);
    else x = exponential(DualMatrix(rates * (s * m.rig().semichord() / c.speed))).value * x;
    VectorXd load(3);
    load << system.A.value.row(n).tail(others) * x, system.A.value.row(2 * n - 1).tail(others) * x, system.C.value.row(0).tail(others) * x;
    return load;
  };
  return loads(model, theta, false).cwiseQuotient(loads(bare, theta.head(bare.start_values().size()), true));
}

/// The law that stands in effects.md, whatever comes before it.
TEST(Effects, TheLoadAfterAStepFollowsTheStatedBuildUp) {
  constexpr double w = 0.6, a1 = 0.1, r1 = 0.08, a2 = 0.15, r2 = 0.7, loss = 0.3, time = 4;
  const AeroelasticModel bare(beam(), make_basis(beam(), Index{3}, Index{1}), wagner(Wagner::within_1e4));
  const auto model_of_both = [&](const std::vector<std::string>& ids) { return bare.with_effects(ids); };
  const IndicialFunction& own = bare.circulation();
  for (const double s : {0.0, 0.5, 2.0, 8.0, 40.0}) {
    const double replaced = 1 - (1 - w) * (1 - own(s)) - a1 * std::exp(-r1 * s) - a2 * std::exp(-r2 * s), lost = loss * (1 - std::exp(-s / time));
    const auto expect = [&](const std::vector<std::string>& ids, double phi) {
      const AeroelasticModel model = model_of_both(ids);
      VectorXd theta = model.start_values();
      const auto set = [&](const char* name, double value) { theta[model.index(name)] = value; };
      for (const std::string& id : ids) {
        if (id == "separation-lag") set("separation-lag.loss", loss), set("separation-lag.time", time);
        else set("wagner-lag.replaced_share", w), set("wagner-lag.amplitude_1", a1), set("wagner-lag.rate_1", r1), set("wagner-lag.amplitude_2", a2), set("wagner-lag.rate_2", r2);
      }
      for (const double share : built_up(model, theta, s)) EXPECT_NEAR(share, phi, 1e-10) << ids.front() << " at " << s << " semichords";
    };
    expect({"wagner-lag"}, replaced);
    expect({"separation-lag"}, own(s) - lost);
    expect({"wagner-lag", "separation-lag"}, replaced - lost);
    expect({"separation-lag", "wagner-lag"}, replaced - lost);
  }
}

/// At its start values, no amplitude and nothing replaced, it is the unmodified model to the last digit.
TEST(Effects, ABuildUpOfWhichNothingIsReplacedIsTheModelsOwn) {
  const AeroelasticModel model = model_with(beam(), "wagner-lag"), bare(beam(), model.basis(), model.circulation());
  const LinearSystem with = model.system(conditions_for(beam()), model.start_values(), {"gauge"}), without = bare.system(conditions_for(beam()), bare.start_values(), {"gauge"});
  const Index n = without.states(), added = with.states() - n;
  EXPECT_EQ(with.A.value.topLeftCorner(n, n), without.A.value);
  EXPECT_EQ(with.A.value.topRightCorner(n, added), MatrixXd::Zero(n, added));
  EXPECT_EQ(with.B.value.topRows(n), without.B.value);
  EXPECT_EQ(with.C.value.leftCols(n), without.C.value);
  EXPECT_EQ(with.C.value.rightCols(added), MatrixXd::Zero(1, added));
  EXPECT_EQ(with.D.value, without.D.value);
}

/// What the gauge reads of a force at 3 Hz.
std::complex<double> response_to_force(const AeroelasticModel& model, const VectorXd& theta) {
  const LinearSystem system = model.system(conditions_for(model.rig()), theta, {"gauge"});
  const Eigen::MatrixXcd at = std::complex<double>(0, 2 * pi * 3) * Eigen::MatrixXcd::Identity(system.states(), system.states()) - system.A.value;
  return (system.C.value.row(0) * at.partialPivLu().solve(system.B.value.col(0).cast<std::complex<double>>()))(0) + system.D.value(0, 0);
}

/// The same, and beside it what the laws make of arguments that are not zero.
std::complex<double> response_and_forces(const AeroelasticModel& model, const VectorXd& theta) {
  std::complex<double> all = response_to_force(model, theta);
  for (const Feedback& f : model.system(conditions_for(model.rig()), theta, {"gauge"}).feedback) all += force_of(f, VectorXd::Constant(f.sees.rows(), 3e-3).eval().data(), theta).value;
  return all;
}

TEST(Effects, ATermWithoutAmplitudeHasNoOtherParameters) {
  int terms = 0;
  for (const auto& [e, rig] : cases())
    for (const std::vector<Index>& term : e->terms) {
      ++terms;
      const AeroelasticModel model = model_with(rig, e->id);
      VectorXd theta = at_work(model, *e);
      auto own = theta.tail(static_cast<Index>(e->parameters_on(rig).size()));
      const std::complex<double> whole = response_and_forces(model, theta);
      own[term.front()] = 0;
      const std::complex<double> without = response_and_forces(model, theta);
      EXPECT_GT(std::abs(whole - without), 1e-6 * std::abs(whole)) << e->id;
      for (std::size_t k = 1; k < term.size(); ++k) own[term[k]] *= 1.7;
      EXPECT_LT(std::abs(response_and_forces(model, theta) - without), 1e-12 * std::abs(whole)) << e->id;
    }
  EXPECT_GT(terms, 0);
}

/// What drives the states of a signal that wanders: nothing else, and with its partials. There is one, and where it does not act there is no noise.
TEST(Effects, NoiseDrivesTheStatesOfItsEffect) {
  int wander = 0;
  for (const auto& [e, rig] : cases()) {
    // A signal before it, whose states are not its own.
    const AeroelasticModel model = e->id == "gauge-drift" ? model_with(rig, e->id) : AeroelasticModel(model_with(rig, "gauge-drift")).with_effects({e->id});
    const VectorXd theta = at_work(model, *e);
    const Conditions conditions = conditions_for(rig);
    const std::vector<std::string> channels{"gauge"};
    const auto noise = [&](const VectorXd& there) { return process_noise(model, conditions, there, channels, model.system(conditions, there, channels)); };
    const std::optional<DualMatrix> at = noise(theta);
    ASSERT_EQ(at.has_value(), e->noise != nullptr) << e->id;
    if (!at) continue;
    ++wander;
    const LinearSystem system = model.system(conditions, theta, channels);
    const Index own = e->states(model, conditions);
    ASSERT_EQ(at->rows(), system.states());
    EXPECT_GT(at->value.bottomRows(own).norm(), 0) << e->id;
    EXPECT_EQ(at->value.topRows(system.states() - own).norm(), 0) << e->id << ": the rig moves because the force does";
    for (Index j = 0; j < theta.size(); ++j) {
      const double h = step * (theta[j] == 0 ? 1 : std::abs(theta[j]));
      const auto value = [&](double by) -> MatrixXd { return noise(theta + by * VectorXd::Unit(theta.size(), j))->value; };
      const MatrixXd slope = slope_of(value, h), exact = at->depends_on(j) ? at->d(j) : MatrixXd::Zero(slope.rows(), slope.cols());
      expect_slope(exact, slope, at->value, h, e->id + ": noise by " + model.parameters()[static_cast<std::size_t>(j)].name);
    }
    Conditions still = conditions;
    still.speed = 0;
    EXPECT_EQ(e->acts(rig, still), process_noise(model, still, theta, channels, model.system(still, theta, channels)).has_value()) << e->id;
  }
  EXPECT_GT(wander, 0);
}

/// Value of a law at (z, p), and its derivatives in each of both.
struct Point {
  double value;
  VectorXd slope;
};
Point point_of(const Feedback::Law& law, const VectorXd& z, const VectorXd& p) {
  Point point{0, VectorXd::Zero(z.size() + p.size())};
  point.value = law(z.data(), p.data(), point.slope.data(), point.slope.data() + z.size());
  return point;
}

void expect_law_slopes(const Feedback::Law& law, const VectorXd& z, const VectorXd& p, const std::string& what) {
  const Point at = point_of(law, z, p);
  for (Index k = 0; k < z.size() + p.size(); ++k) {
    const double here = k < z.size() ? z[k] : p[k - z.size()], h = 1e-5 * std::max(1e-3, std::abs(here));
    const auto value = [&](double by) {
      VectorXd there = z, with = p;
      (k < z.size() ? there[k] : with[k - z.size()]) += by;
      return point_of(law, there, with).value;
    };
    // Rounding of a law is that of the largest term of it, which its slope in any argument times that argument shows as well as its value.
    const double largest = std::max(std::abs(at.value), std::abs(at.slope[k] * here));
    EXPECT_NEAR(at.slope[k], slope_of(value, h), relative * std::abs(at.slope[k]) + 1e-14 * largest / h) << what << ", derivative " << k << " at " << z.transpose() << "; " << p.transpose();
  }
}

/// Every law (rates of memories are laws too), within and beyond what its own parameters make of a scale, rounded corners included, and in every quadrant of its arguments.
TEST(Effects, LawsHaveExactDerivativesInEveryArgumentAndParameter) {
  int laws = 0;
  for (const auto& [e, rig] : cases()) {
    const AeroelasticModel model = model_with(rig, e->id);
    const VectorXd theta = at_work(model, *e);
    for (const Feedback& f : model.system(conditions_for(rig), theta, {"gauge"}).feedback) {
      ++laws;
      const VectorXd p = theta.segment(f.first_parameter, f.parameters);
      std::vector<double> scales{1e-3, 0.4};
      for (const double own : p) scales.push_back(std::abs(own));
      const Index arguments = f.sees.rows();
      for (const double scale : scales)
        for (const double part : {0.31, 0.9985, 1.001, 1.7})
          for (int quadrant = 0; quadrant < (1 << arguments); ++quadrant) {
            VectorXd z(arguments);
            for (Index k = 0; k < arguments; ++k) z[k] = ((quadrant >> k) & 1 ? -1 : 1) * part * (k == 0 ? scale : 0.7);
            expect_law_slopes(f.law, z, p, e->id);
            if (f.rounded) expect_law_slopes(f.rounded, z, p, e->id + ", rounded");
          }
    }
  }
  EXPECT_GT(laws, 10) << "otherwise this looks at nothing";
}

/// The number of states may not depend on theta: searches carry initial states from one theta to the next (a line at 50.05 Hz, sampled at 200 Hz, wrote beyond them). At every corner of
/// the bounds, at every sampling rate that cuts something off.
TEST(Effects, AddAsManyStatesWhateverTheirParameters) {
  for (const auto& [e, rig] : cases())
    for (const double nyquist : {0.0, 55.0, 100.0, 110.0, 250.0}) {
      Conditions conditions = conditions_for(rig);
      conditions.nyquist = nyquist;
      const AeroelasticModel model = model_with(rig, e->id);
      const VectorXd usual = at_work(model, *e);
      const LinearSystem at = model.system(conditions, usual, {"gauge"});
      const auto own = static_cast<Index>(e->parameters_on(rig).size());
      for (Index j = usual.size() - own; j < usual.size(); ++j) {
        const Parameter& p = model.parameters()[static_cast<std::size_t>(j)];
        for (const double part : {0.0, 0.05, 0.1, 0.5, 1.0}) {
          VectorXd theta = usual;
          theta[j] = p.lower + part * (p.upper - p.lower);
          const LinearSystem there = model.system(conditions, theta, {"gauge"});
          const std::string what = e->id + ", " + p.name + " = " + std::to_string(theta[j]) + " at " + std::to_string(nyquist);
          EXPECT_EQ(there.states(), at.states()) << what;
          EXPECT_EQ(there.exogenous, at.exogenous) << what;
          EXPECT_EQ(there.settling, at.settling) << what;
          EXPECT_EQ(there.feedback.size(), at.feedback.size()) << what;
        }
      }
    }
}

TEST(Effects, HaveAdviceForEveryParameterAndADrawingWithinItsBounds) {
  const AeroelasticModel bare(beam(), make_basis(beam(), Index{3}, Index{1}), wagner(Wagner::jones));
  std::mt19937_64 random(5);
  for (const Effect& e : effects()) {
    for (const std::vector<Parameter>* parameters : {&e.parameters, &e.modal_parameters})
      for (const Parameter& p : *parameters) EXPECT_THAT(p.advice, HasSubstr("Record")) << e.id << "." << p.name;
    if (e.parameters.empty()) continue;
    ASSERT_TRUE(e.draw) << e.id;
    for (int draw = 0; draw < 50; ++draw) {
      const VectorXd p = e.draw(bare, 20, random);
      ASSERT_EQ(p.size(), static_cast<Index>(e.parameters.size())) << e.id;
      for (Index k = 0; k < p.size(); ++k) {
        EXPECT_GE(p[k], e.parameters[static_cast<std::size_t>(k)].lower) << e.id << " " << k;
        EXPECT_LE(p[k], e.parameters[static_cast<std::size_t>(k)].upper) << e.id << " " << k;
      }
    }
  }
}

/// Frequencies [Hz] that the gauge reads of the hum, for a fundamental.
std::vector<double> heard(double fundamental, double nyquist) {
  const AeroelasticModel model = model_with(two_modes(), "mains-hum");
  Conditions conditions = conditions_for(two_modes());
  conditions.nyquist = nyquist;
  VectorXd theta = model.start_values();
  theta[model.index("mains-hum.frequency")] = fundamental;
  const LinearSystem system = model.system(conditions, theta, {"gauge"});
  std::vector<double> frequencies;
  for (const Index i : system.exogenous)
    if (system.C.value(0, i) != 0) frequencies.push_back(system.A.value.row(i).cwiseAbs().maxCoeff() / (2 * pi));
  return frequencies;
}

TEST(Effects, HumAboveTheNyquistFrequencyIsNotHeard) {
  for (double nyquist = 51; nyquist < 200; nyquist += 1.7)
    for (const double f : {49.5, 50.0, 50.5, 59.4, 60.0, 60.6})
      for (const double heard_at : heard(f, nyquist)) EXPECT_LT(heard_at, nyquist) << f;
  EXPECT_EQ(heard(50, 100).size(), 1u) << "100 Hz may be beyond";
  EXPECT_EQ(heard(50, 110).size(), 2u);
  EXPECT_EQ(heard(60, 110).size(), 1u);
  EXPECT_EQ(heard(60, 125).size(), 2u);
  EXPECT_EQ(heard(60, 55).size(), 0u);
  EXPECT_EQ(heard(50, 250).size(), 3u);
  EXPECT_FALSE(effect("mains-hum").acts(two_modes(), [] { Conditions c; c.nyquist = 50; return c; }()));
}

TEST(Effects, MainsAreFiftyOrSixtyHertz) {
  const AeroelasticModel model = model_with(two_modes(), "mains-hum");
  const Index frequency = model.index("mains-hum.frequency");
  for (const double value : {50.2, 47.0}) EXPECT_EQ(bounds_at(model, frequency, value), Effect::Band(49.5, 50.5)) << value;
  for (const double value : {59.9, 58.0, 63.0}) EXPECT_EQ(bounds_at(model, frequency, value), Effect::Band(59.4, 60.6)) << value;
  const Parameter& mass = model.parameters().front();
  EXPECT_EQ(bounds_at(model, 0, mass.start), Effect::Band(mass.lower, mass.upper));
}

/// Fage and Johansen: a street is shed from the angle of stall on.
TEST(Effects, SheddingBeginsAtEightDegrees) {
  const char* id = "vortex-shedding";
  Conditions c = conditions_for(beam());
  for (const double degrees : {1.0, 7.9, -7.9}) {
    c.onset_angle = degrees * pi / 180;
    EXPECT_FALSE(effect(id).acts(beam(), c)) << degrees;
    const AeroelasticModel model = model_with(beam(), id), bare(beam(), model.basis(), model.circulation());
    EXPECT_EQ(model.system(c, model.start_values(), {"gauge"}).states(), bare.system(c, bare.start_values(), {"gauge"}).states());
  }
  for (const double degrees : {8.1, 25.0, -8.1}) {
    c.onset_angle = degrees * pi / 180;
    EXPECT_TRUE(effect(id).acts(beam(), c)) << degrees;
  }
}

/// A step from rest at 2 degrees loses lift as one from 25 does.
TEST(Effects, SeparationActsAtAnyAngleInAStream) {
  Conditions c = conditions_for(beam());
  for (const double degrees : {0.0, 2.0, 25.0}) {
    c.onset_angle = degrees * pi / 180;
    EXPECT_TRUE(effect("separation-lag").acts(beam(), c)) << degrees;
  }
  c.speed = 0;
  EXPECT_FALSE(effect("separation-lag").acts(beam(), c));
}

TEST(Effects, SayWhyTheyCannotAct) {
  Conditions still;  // in no fluid at all
  EXPECT_THAT(why_idle(effect("quadratic-drag"), beam(), {still}), HasSubstr("cubic-damping"));
  EXPECT_THAT(why_idle(effect("quadratic-drag"), two_modes(), {still}), IsEmpty()) << "there its coefficient is a force over velocity squared";
  Conditions air;
  air.density = 1.2;
  EXPECT_THAT(why_idle(effect("quadratic-drag"), beam(), {still, air}), HasSubstr("cubic-damping"));
  Conditions water;
  water.density = 998.2;
  EXPECT_THAT(why_idle(effect("quadratic-drag"), beam(), {air, water}), IsEmpty());
  EXPECT_THAT(why_idle(effect("wagner-lag"), beam(), {air}), HasSubstr("stream"));
  EXPECT_THAT(why_idle(effect("wagner-lag"), two_modes(), {air}), HasSubstr("modes"));
  EXPECT_THAT(why_idle(effect("twist-stiffness"), read_rig(test::null_campaign("rig.toml")), {air}), HasSubstr("[[sensor]]"));
  Rig whole = beam();
  whole.normal.modes = 0;
  EXPECT_THAT(why_idle(effect("higher-mode"), whole, {air}), HasSubstr("leaves modes out"));
  for (const auto& [e, rig] : cases()) EXPECT_THAT(why_idle(*e, rig, {conditions_for(rig)}), IsEmpty()) << "otherwise the tests of this file look at less than they say";
}

TEST(Effects, AreDistinctAtTheirStarts) {
  for (const Rig& rig : {beam(), two_modes()})
    for (const Effect& e : effects()) {
      if (!e.distinct) continue;
      const AeroelasticModel model = AeroelasticModel(rig, rig.is_modal() ? Basis{} : make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones)).with_effects({e.id});
      EXPECT_TRUE(e.distinct(model, model.start_values(), 100)) << e.id << " of " << rig.file;
    }
}

/// Peaks overlap within half of the sum of their half-power bandwidths.
TEST(Effects, AModeThatMakesOnePeakWithAKnownOneIsNotDistinct) {
  const Rig rig = two_modes();
  const AeroelasticModel model = AeroelasticModel(rig, Basis{}, wagner(Wagner::jones)).with_effects({"higher-mode"});
  Eigen::VectorXd theta = model.start_values();
  const double known = rig.modal[0].frequency, width = 0.02;
  theta[model.index("higher-mode.damping_ratio")] = width;
  const auto distinct_at = [&](double hertz) {
    theta[model.index("higher-mode.frequency")] = hertz;
    return effect("higher-mode").distinct(model, theta, 10);
  };
  const double overlap = (width + rig.modal[0].damping_ratio) * known;
  EXPECT_FALSE(distinct_at(known));
  EXPECT_FALSE(distinct_at(known + 0.9 * overlap));
  EXPECT_FALSE(distinct_at(known - 0.9 * overlap));
  EXPECT_TRUE(distinct_at(known - 1.1 * overlap));
  EXPECT_FALSE(distinct_at(rig.modal[1].frequency));
  const double decay_time = 1 / (2 * pi * width * 50);
  theta[model.index("higher-mode.frequency")] = 50;
  EXPECT_TRUE(effect("higher-mode").distinct(model, theta, 1.1 * decay_time));
  EXPECT_FALSE(effect("higher-mode").distinct(model, theta, 0.9 * decay_time)) << "a tone";
}

TEST(Effects, UnknownIdsAreRefused) {
  EXPECT_THROW(effect("tank-waves"), std::invalid_argument);
  for (const Effect& e : effects()) EXPECT_EQ(effect(e.id).id, e.id);
}

}  // namespace
}  // namespace unrig
