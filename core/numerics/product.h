#pragma once
#include <Eigen/Core>

namespace unrig {

/// a b, rows x columns, of dense matrices of some ten to a few hundred rows, in the widest vectors that the processor has.
/// Products are rounded before they are added, in the order of the inner index: x86 processors with AVX2 and without get the same digits.
/// What is larger, or a vector, is left to Eigen.
Eigen::MatrixXd product(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b);

/// c = a b and c += a b; `c` has their size and is no part of the others.
void set_product(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b, Eigen::MatrixXd& c);
void add_product(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b, Eigen::MatrixXd& c);

}  // namespace unrig
