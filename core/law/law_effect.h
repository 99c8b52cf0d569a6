#pragma once
#include <memory>
#include <string>

#include "core/effects/effect.h"
#include "core/law/law.h"

namespace unrig {

/// An effect that a user wrote down. All of Rig::laws are such.
struct LawEffect : Effect {
  std::shared_ptr<const Law> law;
};

/// The law as an effect: its id is Law::id, its parameters are the file's, its search begins at their start values.
///
/// The symbols are what moves from where the rig stood before the run: x, v, a of the first normal mode at the element that the dead weights hung at (a rig of modes: the first
/// mode's coordinate; `lift`: of the strip), twist and twist_rate of the first torsional mode at the outermost strip (`lift`: of the strip), theta and alpha in full, with the shaft's angle before it moves; alpha
/// of the strip, or the mean of the strips, without what the mount moves by; t from the first sample. A force without t counts from what it is at rest where the run begins: that is part
/// of the steady load. It pushes the way its place moves.
///
///   x' = A x + B (u + direction f(symbols)),   z' = memory(symbols, z)
///
/// A term `factor * a` whose factor stays what it is within a run is a mass: with a = r x' it is solved for exactly, f = factor a_0 / (1 - factor r b), a_0 the acceleration without it, b what a
/// unit force does to x'. Elsewhere a law sees the acceleration that its own force has part in (core/propagate/feedback_force.h).
/// A term `factor * z` is linear and stays with the exact step (core/propagate/nonlinear_response.h); the rest runs as parabolas over the steps.
std::shared_ptr<const LawEffect> law_effect(Law law);

/// Puts a law to a rig. Throws InputError where the rig has one of the same id.
void add_law(Rig& rig, Law law);

/// Of the rig's laws, then of the table, by id; throws std::invalid_argument naming the choices.
const Effect& effect(const Rig& rig, const std::string& id);

/// Whether the name, of an effect or of a parameter, begins as those of laws do.
inline bool is_law_id(const std::string& name) { return name.starts_with("law:"); }

/// The law that an effect of Rig::laws was made of.
const Law& law_of(const Effect& effect);

}  // namespace unrig
