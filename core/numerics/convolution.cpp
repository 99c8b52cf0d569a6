#include "core/numerics/convolution.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <stdexcept>

#include <fmt/format.h>

#include "core/numerics/in_parallel.h"
#include "core/numerics/smooth_ramp.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Direction = Convolution::Direction;

namespace {

constexpr Index strides_in_near = 256, nears_in_piece = 8;

/// The next length whose only prime factors are 2 and one 3 or 5.
Index quick_length(Index least) {
  Index best = 1;
  while (best < least) best *= 2;
  for (const Index odd : {3, 5, 9})
    for (Index length = odd; length < best; length *= 2)
      if (length >= least && length % 2 == 0) best = length;
  return best;
}

/// Cubic B-splines of the four nodes around a sample, by its distance from the second of them.
using Splines = std::array<double, 4>;
std::vector<Splines> splines_within(Index stride) {
  std::vector<Splines> splines;
  for (Index k = 0; k < stride; ++k) {
    const double x = static_cast<double>(k) / static_cast<double>(stride), y = 1 - x;
    splines.push_back({y * y * y / 6, (4 - 6 * x * x + 3 * x * x * x) / 6, (4 - 6 * y * y + 3 * y * y * y) / 6, x * x * x / 6});
  }
  return splines;
}

/// Transforms of records, each made once. What is handed out is good until the next is made.
class Transforms {
 public:
  const VectorXcd& of(const double* record, const std::function<void(VectorXcd& made)>& make) {
    const auto known = std::find(records_.begin(), records_.end(), record);
    if (known != records_.end()) return lines_[static_cast<std::size_t>(known - records_.begin())];
    records_.push_back(record);
    make(lines_.emplace_back());
    return lines_.back();
  }

 private:
  std::vector<const double*> records_;
  std::vector<VectorXcd> lines_;
};

void add_product(VectorXcd& sum, const VectorXcd& kernel, const VectorXcd& record, Direction direction) {
  if (sum.size() == 0) sum = VectorXcd::Zero(record.size());
  if (direction == Direction::past)
    sum += kernel.cwiseProduct(record);
  else
    sum += kernel.conjugate().cwiseProduct(record);
}

}  // namespace

Convolution::Convolution(Index samples, Index near) : samples_(samples), near_(near == 0 ? samples : near) {
  if (near == 0) {
    piece_ = samples;
    plan_ = std::make_shared<FourierPlan>(quick_length(std::max<Index>(2, 2 * samples)));
    return;
  }
  if (near % (2 * strides_in_near) != 0) throw std::invalid_argument(fmt::format("kernels are not divided behind {} samples", near));
  constexpr Index ringing = 16;  // nodes: 0.27^16 of where the kernel is cut off
  stride_ = near / strides_in_near;
  margin_ = near;
  plan_ = std::make_shared<FourierPlan>(nears_in_piece * near);
  piece_ = plan_->length() - 2 * margin_;
  nodes_ = (samples - 1) / stride_ + 4;
  far_ = nodes_ + ringing - half() / stride_;
  if (far_ < 1) throw std::invalid_argument(fmt::format("a record of {} samples is not divided behind {}", samples, near));
  coarse_plan_ = std::make_shared<FourierPlan>(quick_length(2 * (nodes_ + ringing)));
}

Convolution::Kernel Convolution::kernel(const VectorXd& near, const VectorXd& far) const {
  if (near.size() != near_ || far.size() != far_) throw std::invalid_argument(fmt::format("a kernel of {} and {} samples, not of {} and {}", near.size(), far.size(), near_, far_));
  if (stride_ == 0) return {plan_->forward(near), {}};
  const auto u = [&](Index i) { return smooth_ramp(static_cast<double>(i - half()) / static_cast<double>(half())); };
  VectorXd fine = near;
  for (Index i = half(); i < near_; ++i) fine[i] *= 1 - u(i);
  VectorXd coarse = VectorXd::Zero(half() / stride_ + far_);
  for (Index i = 0; i < far_; ++i) coarse[half() / stride_ + i] = far[i] * u(half() + i * stride_);
  Kernel kernel{plan_->forward(fine), coarse_plan_->forward(coarse)};
  for (Index k = 0; k < kernel.coarse.size(); ++k) {  // splines through the values: in i, and in j
    const double spline = (4 + 2 * std::cos(2 * std::acos(-1.0) * static_cast<double>(k) / static_cast<double>(coarse_plan_->length()))) / 6;
    kernel.coarse[k] /= spline * spline;
  }
  return kernel;
}

VectorXd Convolution::onto_nodes(const double* record) const {
  const std::vector<Splines> splines = splines_within(stride_);
  VectorXd nodes = VectorXd::Zero(nodes_);
  for (Index k = 0; k < samples_; ++k) {
    const Splines& weight = splines[static_cast<std::size_t>(k % stride_)];
    for (Index i = 0; i < 4; ++i) nodes[k / stride_ + i] += weight[static_cast<std::size_t>(i)] * record[k];
  }
  return nodes;
}

void Convolution::add_smooth_parts(const std::vector<Sum>& sums, const std::vector<Index>& at, MatrixXd& result) const {
  const std::vector<Splines> splines = splines_within(stride_);
  Transforms transforms;
  for (Index column = 0; column < result.cols(); ++column) {
    VectorXcd lines;
    for (const Sum& sum : sums)
      if (sum.into == column) add_product(lines, sum.kernel->coarse, transforms.of(sum.record, [&](VectorXcd& made) { made = coarse_plan_->forward(onto_nodes(sum.record)); }), sum.direction);
    if (lines.size() == 0) continue;
    const VectorXd nodes = coarse_plan_->inverse(lines);
    for (Index row = 0; row < result.rows(); ++row) {
      const Index k = at.empty() ? row : at[static_cast<std::size_t>(row)];
      const Splines& weight = splines[static_cast<std::size_t>(k % stride_)];
      for (Index i = 0; i < 4; ++i) result(row, column) += weight[static_cast<std::size_t>(i)] * nodes[k / stride_ + i];
    }
  }
}

void Convolution::add_piece(const std::vector<Sum>& sums, Index first, const std::vector<Index>& at, MatrixXd& result) const {
  const Index begin = std::max<Index>(0, first - margin_), end = std::min(samples_, first + piece_ + margin_), lead = begin - (first - margin_), count = std::min(piece_, samples_ - first);
  VectorXd window(plan_->length());
  VectorXcd lines;
  Transforms transforms;
  const double scale = 1 / static_cast<double>(plan_->length());
  for (Index column = 0; column < result.cols(); ++column) {
    lines.resize(0);
    for (const Sum& sum : sums) {
      if (sum.into != column) continue;
      const VectorXcd& record = transforms.of(sum.record, [&](VectorXcd& made) {
        window.setZero();
        window.segment(lead, end - begin) = Eigen::Map<const VectorXd>(sum.record + begin, end - begin);
        plan_->forward(window, made);
      });
      add_product(lines, sum.kernel->fine, record, sum.direction);
    }
    if (lines.size() == 0) continue;
    plan_->inverse(lines, window);
    if (at.empty()) {
      result.col(column).segment(first, count) += scale * window.segment(margin_, count);
      continue;
    }
    for (auto k = std::lower_bound(at.begin(), at.end(), first); k != at.end() && *k < first + count; ++k) result(k - at.begin(), column) += scale * window[margin_ + *k - first];
  }
}

MatrixXd Convolution::sums(const std::vector<Sum>& sums, Index columns, const std::vector<Index>& at) const {
  MatrixXd result = MatrixXd::Zero(at.empty() ? samples_ : static_cast<Index>(at.size()), columns);
  if (sums.empty()) return result;
  if (stride_ > 0) add_smooth_parts(sums, at, result);
  in_parallel(static_cast<std::size_t>((samples_ + piece_ - 1) / piece_), [&](std::size_t i) { add_piece(sums, static_cast<Index>(i) * piece_, at, result); });
  return result;
}

double Convolution::mean(const VectorXd& power) const {
  return (2 * power.sum() - power[0] - power[power.size() - 1]) / static_cast<double>(length());
}

Index near_samples(const VectorXcd& eigenvalues, Index samples) {
  constexpr double left = 1e-8;  // of a response, where it may still vary within a stride
  constexpr Index least = 8192;  // shorter ones cost as much a sample
  for (Index near = least; nears_in_piece * near <= samples; near *= 2) {
    const double stride = static_cast<double>(near) / strides_in_near, half = static_cast<double>(near) / 2;
    const bool smooth = std::all_of(eigenvalues.begin(), eigenvalues.end(), [&](const std::complex<double>& lambda) {
      if (std::abs(lambda) == 0) return true;
      const std::complex<double> rate = -std::log(lambda);
      return std::min(1.0, std::pow(std::abs(rate) * stride, 4) / 192) * std::exp(-rate.real() * half) < left;
    });
    if (smooth) return near;
  }
  return 0;
}

}  // namespace unrig
