#include "core/law/law_effect.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/law/law_view.h"
#include "core/propagate/feedback_force.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;

using Symbols = LawView::Symbols;


/// An expression as the law of a feedback: of the arguments that it looks at.
struct Seen {
  std::shared_ptr<const Expression> expression;
  Symbols at_rest;
  std::vector<std::size_t> symbol;  // of each argument
  std::size_t parameters;
  bool counts_from_rest;

  double operator()(const double* z, const double* p, double* slope, double* partial) const {
    Symbols value = at_rest, in_symbols;
    for (std::size_t k = 0; k < symbol.size(); ++k) value[symbol[k]] += z[k];
    double f = (*expression)(value.data(), p, in_symbols.data(), partial);
    for (std::size_t k = 0; k < symbol.size(); ++k) slope[k] = in_symbols[symbol[k]];
    if (!counts_from_rest) return f;
    std::array<double, most_law_parameters> at_start;
    f -= (*expression)(at_rest.data(), p, in_symbols.data(), at_start.data());
    for (std::size_t k = 0; k < parameters; ++k) partial[k] -= at_start[k];
    return f;
  }
};

/// Whether a force is anything at rest, at these parameters or near them.
bool acts_at_rest(const Expression& force, const Symbols& at_rest, const double* p, std::size_t parameters) {
  Symbols in_symbols;
  std::array<double, most_law_parameters> partial{};
  if (force(at_rest.data(), p, in_symbols.data(), partial.data()) != 0) return true;
  return std::any_of(partial.begin(), partial.begin() + static_cast<std::ptrdiff_t>(parameters), [](double d) { return d != 0; });
}

/// factor * symbol + rest, where the factor stays what it is within a run.
auto constant_share(const Expression& force, Symbol symbol) {
  auto split = force.linear_in(symbol);
  for (std::size_t s = 0; s < symbol_count && split; ++s)
    if (static_cast<Symbol>(s) != Symbol::U && split->factor.uses(static_cast<Symbol>(s))) split.reset();
  return split;
}

/// What a unit of the law does: to the rates of the states, and to the outputs at once.
struct Push {
  DualMatrix states, outputs;
};

/// One place where a law acts, in one run.
class LawAtWork {
 public:
  LawAtWork(const Law& law, LinearSystem& system, const EffectContext& context) : law_(law), system_(system), c_(context), p_(context.theta.data() + context.first_parameter) {}

  void act() {
    const bool beam = !c_.model.rig().is_modal();
    if (law_.uses(Symbol::t)) append_clock();
    switch (law_.acts_on) {
      case ActsOn::normal: return act_through(port(system_, c_.ports.coordinate, first_mode(c_.model, system_.coordinates)[0]), -1);
      case ActsOn::torsion: {
        const Basis& basis = c_.model.basis();
        if (basis.torsion_modes > 0) act_through(port(system_, c_.ports.coordinate + basis.normal_modes, section_twist(c_.model, system_.coordinates)[basis.normal_modes]), -1);
        return;
      }
      case ActsOn::lift:
        for (Index s = 0; s < c_.ports.strips; ++s) act_through(port(system_, c_.ports.strip + s, 1), s);
        return;
      case ActsOn::mount:
        if (beam) append_mount_velocity();
        return act_through(port(system_, c_.ports.mount + 1, 1), -1);
      case ActsOn::gauge: return act_by({DualMatrix(MatrixXd::Zero(system_.states(), 1), c_.theta.size()), gauge()}, -1);
    }
  }

 private:
  DualMatrix gauge() const {
    MatrixXd row = MatrixXd::Zero(system_.C.rows(), 1);
    if (c_.gauge >= 0) row(c_.gauge, 0) = 1;
    return DualMatrix(row, c_.theta.size());
  }

  void act_through(const DualMatrix& direction, Index strip) {
    Push push{system_.B * direction, system_.D * direction};
    if (mount_velocity_ >= 0) push.states.value(mount_velocity_, 0) = 1;
    act_by(std::move(push), strip);
  }

  void act_by(Push push, Index strip) {
    Expression force = law_.force;
    LawView view = view_of(strip);
    if (const auto split = force.uses(Symbol::a) ? constant_share(force, Symbol::a) : std::nullopt) {
      push = add_mass(push, view, factor_of(split->factor, view));
      force = split->rest;
    }
    if (law_.memory) force = add_memory(push, view, std::move(force));
    if (force.is_zero()) return;
    const bool counts_from_rest = !law_.uses(Symbol::t) && acts_at_rest(force, view.at_rest, p_, law_.parameters.size());
    append_input(push, feedback_of(force, view, counts_from_rest));
  }

  LawView view_of(Index strip) const {
    LawView view = law_view(c_.model, system_, c_.conditions, strip);
    if (clock_ >= 0) view.row[index_of(Symbol::t)] = state(clock_);
    return view;
  }

  RowVectorXd state(Index index) const { return RowVectorXd::Unit(system_.states(), index); }

  Feedback feedback_of(const Expression& expression, const LawView& view, bool counts_from_rest) const {
    Seen seen{std::make_shared<const Expression>(expression), view.at_rest, {}, law_.parameters.size(), counts_from_rest};
    for (std::size_t s = 0; s < symbol_count; ++s)
      if (expression.uses(static_cast<Symbol>(s)) && view.row[s].size() > 0) seen.symbol.push_back(s);
    Feedback feedback;
    feedback.sees = MatrixXd::Zero(std::max<Index>(1, static_cast<Index>(seen.symbol.size())), system_.states());
    if (expression.uses(Symbol::a)) feedback.sees_rates = feedback.sees;
    for (std::size_t k = 0; k < seen.symbol.size(); ++k) {
      MatrixXd& sees = seen.symbol[k] == index_of(Symbol::a) ? feedback.sees_rates : feedback.sees;
      sees.row(static_cast<Index>(k)).head(view.row[seen.symbol[k]].size()) = view.row[seen.symbol[k]];
    }
    feedback.first_parameter = c_.first_parameter;
    feedback.parameters = static_cast<Index>(law_.parameters.size());
    feedback.law = std::move(seen);
    return feedback;
  }

  /// A factor of parameters and the speed, 1 x 1.
  DualMatrix factor_of(const Expression& factor, const LawView& view) const {
    Symbols in_symbols;
    std::array<double, most_law_parameters> partial{};
    DualMatrix value(MatrixXd::Constant(1, 1, factor(view.at_rest.data(), p_, in_symbols.data(), partial.data())), c_.theta.size());
    for (std::size_t k = 0; k < law_.parameters.size(); ++k)
      if (partial[k] != 0) value.add_partial(c_.first_parameter + static_cast<Index>(k), MatrixXd::Constant(1, 1, partial[k]));
    return value;
  }

  /// f = factor a, a = r x' with f in x' too. Returns what a unit of another force does now that it moves the mass too.
  Push add_mass(const Push& push, const LawView& view, const DualMatrix& factor) {
    const MatrixXd r = rate_of(system_, view.moves);  // reads velocities out of the states, accelerations out of their rates
    const DualMatrix own = r * push.states;
    const DualMatrix answer = solve(DualMatrix(MatrixXd::Ones(1, 1), c_.theta.size()) - factor * own, factor);
    const DualMatrix by_states = answer * (r * system_.A), by_inputs = answer * (r * system_.B), by_force = answer * own;
    system_.A = system_.A + push.states * by_states;
    system_.B = system_.B + push.states * by_inputs;
    system_.C = system_.C + push.outputs * by_states;
    system_.D = system_.D + push.outputs * by_inputs;
    return {push.states + push.states * by_force, push.outputs + push.outputs * by_force};
  }

  /// z and what it drives; returns the force that is left, which may see z.
  Expression add_memory(Push& push, LawView& view, Expression force) {
    const Index memory = append_state();
    push.states = push.states.grown(memory + 1, 1);
    if (const auto split = constant_share(force, Symbol::z)) {
      const DualMatrix factor = factor_of(split->factor, view);
      system_.A.set_block(0, memory, push.states * factor);
      system_.C.set_block(0, memory, push.outputs * factor);
      force = split->rest;
    }
    view.row[index_of(Symbol::z)] = state(memory);
    append_input({DualMatrix(MatrixXd(state(memory).transpose()), c_.theta.size()), DualMatrix(MatrixXd::Zero(system_.C.rows(), 1), c_.theta.size())}, feedback_of(*law_.memory, view, false));
    return force;
  }

  /// t' = 1.
  void append_clock() {
    clock_ = append_state();
    Feedback one;
    one.sees = state(clock_);
    one.law = [](const double*, const double*, double* slope, double*) {
      *slope = 0;
      return 1.0;
    };
    append_input({DualMatrix(MatrixXd(state(clock_).transpose()), c_.theta.size()), DualMatrix(MatrixXd::Zero(system_.C.rows(), 1), c_.theta.size())}, std::move(one));
  }

  /// The mount's velocity, whose rate the law is, drives what a measured one drives.
  void append_mount_velocity() {
    const DualMatrix velocity = port(system_, c_.ports.mount, 1);
    const DualMatrix push = system_.B * velocity, direct = system_.D * velocity;
    mount_velocity_ = append_state();
    system_.A.set_block(0, mount_velocity_, push);
    system_.C.set_block(0, mount_velocity_, direct);
  }

  Index append_state() {
    const Index n = system_.states();
    system_.A = system_.A.grown(n + 1, n + 1);
    system_.B = system_.B.grown(n + 1, system_.B.cols());
    system_.C = system_.C.grown(system_.C.rows(), n + 1);
    return n;
  }

  void append_input(const Push& push, Feedback feedback) {
    const Index columns = system_.B.cols();
    system_.B = system_.B.grown(system_.B.rows(), columns + 1);
    system_.B.set_block(0, columns, push.states);
    system_.D = system_.D.grown(system_.D.rows(), columns + 1);
    system_.D.set_block(0, columns, push.outputs);
    system_.feedback.push_back(std::move(feedback));
  }

  const Law& law_;
  LinearSystem& system_;
  const EffectContext& c_;
  const double* p_;
  Index clock_ = -1, mount_velocity_ = -1;
};

Index states_of(const Law& law, const AeroelasticModel& model) {
  const Rig& rig = model.rig();
  const Index places = law.acts_on == ActsOn::lift ? static_cast<Index>(rig.submerged.size()) : law.acts_on == ActsOn::torsion && model.basis().torsion_modes < 1 ? 0 : 1;
  const bool shakes = law.acts_on == ActsOn::mount && !rig.is_modal();
  return (law.memory ? places : 0) + (law.uses(Symbol::t) ? 1 : 0) + (shakes ? 1 : 0);
}

bool needs_a_section(const Law& law) {
  if (law.acts_on == ActsOn::lift || law.acts_on == ActsOn::torsion) return true;
  for (const Symbol s : {Symbol::theta, Symbol::theta_rate, Symbol::twist, Symbol::twist_rate, Symbol::alpha})
    if (law.uses(s)) return true;
  return false;
}

const char* symbol_of(ActsOn place) {
  switch (place) {
    case ActsOn::torsion: return "M";
    case ActsOn::gauge: return "gauge +";
    case ActsOn::mount: return "mount acceleration";
    default: return "F";
  }
}

}  // namespace

std::shared_ptr<const LawEffect> law_effect(Law read) {
  auto made = std::make_shared<LawEffect>();
  LawEffect& e = *made;
  e.law = std::make_shared<const Law>(std::move(read));
  const Law& law = *e.law;
  e.id = law.id();
  e.summary = law.name;
  e.equation = fmt::format("{} = {}{}", symbol_of(law.acts_on), law.force_text, law.memory ? ", z' = " + law.memory_text : "");
  std::replace_if(e.equation.begin(), e.equation.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  e.kind = law.kind();
  e.source = law.file;
  e.parameters = law.parameters;
  Eigen::VectorXd start(static_cast<Index>(e.parameters.size()));
  for (Index k = 0; k < start.size(); ++k) start[k] = e.parameters[static_cast<std::size_t>(k)].start;
  e.starts = {start};
  e.in_the_load = law.acts_on == ActsOn::lift;
  e.needs = needs_a_section(law) ? Needs::beam : Needs::any_rig;
  const bool in_a_stream = law.uses(Symbol::alpha);
  e.acts = [in_a_stream](const Rig&, const Conditions& c) { return !in_a_stream || c.speed > 0; };
  if (in_a_stream) e.acts_in = "a run in a stream";
  e.states = [law = e.law](const AeroelasticModel& model, const Conditions&) { return states_of(*law, model); };
  e.apply = [law = e.law](LinearSystem& system, const EffectContext& c) { LawAtWork(*law, system, c).act(); };
  return made;
}

void add_law(Rig& rig, Law law) {
  for (const auto& other : rig.laws)
    if (other->id == law.id()) throw InputError({law.file, 0}, fmt::format("the name \"{}\"", law.name), fmt::format("wanted another than that of the law in {}", law_of(*other).file), "Laws are told apart by their names.");
  rig.laws.push_back(law_effect(std::move(law)));
}

const Effect& effect(const Rig& rig, const std::string& id) {
  for (const auto& law : rig.laws)
    if (law->id == id) return *law;
  return effect(id);
}

const Law& law_of(const Effect& effect) { return *static_cast<const LawEffect&>(effect).law; }

}  // namespace unrig
