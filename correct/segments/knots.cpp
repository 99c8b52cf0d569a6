#include "correct/segments/knots.h"

#include <algorithm>

#include "fit/likelihood/run_residual.h"

namespace unrig {

using Eigen::Index;

Windows generous_windows(const Run& run) {
  constexpr Index more = 40;
  Windows windows = motion_windows(run);
  for (std::size_t w = 0; w < windows.size(); ++w) {
    const Index end = w + 1 < windows.size() ? windows[w + 1].knots.first - 4 * windows[w].stride - 1 : run.samples() - 5;
    windows[w].knots.last = std::max(windows[w].knots.last, std::min(end, windows[w].knots.last + more));
  }
  return windows;
}

Index farthest_knots(const Windows& windows) { return windows.size() > 1 ? 1 : 3; }

bool too_far_apart(const Windows& windows) { return windows.front().stride > farthest_knots(windows); }

Windows with_most_knots(Windows windows) {
  Index total = 0;
  for (const MotionBasis::Window& w : windows) total += w.knots.length();
  for (MotionBasis::Window& w : windows) w.stride = 1 + total / (most_knots_to_fit + 1);
  return windows;
}

Index most_moving(const Windows& windows) { return farthest_knots(windows) * most_knots_to_fit; }

std::vector<Windows> legs_of(const Windows& windows, Index shortest_rest, const std::function<bool(const Interval& samples)>& read) {
  constexpr Index knots_in_leg = 150, level = 50;
  std::vector<Windows> legs;
  Index knots = 0;
  for (const MotionBasis::Window& w : windows) {
    const auto rested = [&] {
      const Index last = legs.back().back().knots.last;
      return w.knots.first - last >= shortest_rest && read({last, last + level}) && read({w.knots.first - level, w.knots.first});
    };
    if (legs.empty() || (knots + w.knots.length() > knots_in_leg && rested())) {
      legs.emplace_back();
      knots = 0;
    }
    legs.back().push_back(w);
    knots += w.knots.length();
  }
  for (Windows& leg : legs) {
    Index total = 0;
    for (const MotionBasis::Window& w : leg) total += w.knots.length();
    for (MotionBasis::Window& w : leg) w.stride = 1 + total / (most_knots(leg.size()) + 1);
    if (too_far_apart(leg)) return {};
  }
  return legs;
}

}  // namespace unrig
