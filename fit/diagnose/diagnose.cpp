#include "fit/diagnose/diagnose.h"

#include "fit/diagnose/as_given.h"
#include "fit/diagnose/diagnosis_search.h"
#include "fit/likelihood/run_order.h"

namespace unrig {
namespace {

Diagnosis diagnose_in_order(const DiagnoseProblem& problem) {
  DiagnosisSearch search(problem);
  search.settle_noise();
  search.ask_about_noise();
  search.ask_about_description();
  search.try_without_a_law();
  search.look_for_a_law();
  search.look_for_effects();
  search.weigh_description();
  search.look_for_the_law_of_what_remains();
  return search.told();
}

}  // namespace

Diagnosis diagnose(const DiagnoseProblem& problem) {
  const std::vector<std::size_t> order = order_of_search(problem.runs);
  if (is_as_given(order)) return diagnose_in_order(problem);
  DiagnoseProblem ordered = problem;
  ordered.runs = in_order(problem.runs, order);
  Diagnosis d = diagnose_in_order(ordered);
  tell_as_given(GivenOrder(problem.runs), problem.runs.size(), d);
  return d;
}

}  // namespace unrig
