#include "fit/likelihood/run_linearised.h"

// Rotations of the rows of one channel over one piece of the record.

namespace unrig::run_rows {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

/// Rows in the coordinates of the rotation: the first it keeps, and the others.
std::pair<MatrixXd, MatrixXd> split(const Householder& rotation, MatrixXd all) {
  all = rotation.rotated(std::move(all));
  const Index kept = std::min(rotation.rows(), rotation.cols());
  return {all.topRows(kept), all.bottomRows(all.rows() - kept)};
}

}  // namespace

MatrixXd Block::add_stretch(MatrixXd span) {
  rotations_.push_back(std::make_shared<const Householder>(std::move(span)));
  return rotations_.back()->triangle();
}

MatrixXd Block::add_stretch(double weight, const Rotation& rotation) {
  rotations_.push_back(rotation);
  return weight * rotation->triangle();
}

MatrixXd Block::join(const std::vector<MatrixXd>& spans) {
  if (spans.size() == 1) return spans.front();
  joint_ = std::make_shared<const Householder>(stacked(spans, spans.front().cols()));
  return joint_->triangle();
}

MatrixXd Block::rotate_rows(const Eigen::VectorXd& w) {
  std::vector<MatrixXd> spans;
  for (Index first = 0; first < rows.rows(); first += rest_rows::stretch_samples) {
    const Index length = std::min(rest_rows::stretch_samples, rows.rows() - first);
    MatrixXd span(length, rows.cols() + 1);
    span << w.segment(first, length).asDiagonal() * rows.middleRows(first, length), w.segment(first, length);
    spans.push_back(add_stretch(std::move(span)));
  }
  return join(spans);
}

void Block::rotate(const Interval& some, MatrixXd all, Rotated& rotated) const {
  if (rotations_.empty()) {
    rotated.kept.push_back(std::move(all));
    return;
  }
  const Index length = moving ? samples.length() : rest_rows::stretch_samples;
  Index row = 0;
  for (Index first = some.first; first < some.last; first += length) {
    const Rotation& rotation = rotations_[static_cast<std::size_t>((first - samples.first) / length)];
    if (!rotation) {
      rotated.kept.push_back(all.middleRows(row, rest_rows::smooth_terms));
      row += rest_rows::smooth_terms;
      continue;
    }
    auto [top, bottom] = split(*rotation, all.middleRows(row, rotation->rows()));
    row += rotation->rows();
    rotated.kept.push_back(std::move(top));
    if (bottom.rows() > 0) rotated.others.push_back(compress(std::move(bottom)));
  }
}

MatrixXd Block::reached(Rotated& rotated) const {
  MatrixXd kept = stacked(rotated.kept, rotated.kept.front().cols());
  if (!joint_) return kept;
  auto [top, bottom] = split(*joint_, std::move(kept));
  if (bottom.rows() > 0) rotated.others.push_back(compress(std::move(bottom)));
  return top;
}

}  // namespace unrig::run_rows
