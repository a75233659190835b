// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Small dense systems of linear equations.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>

namespace polyhull {

/// Solves the symmetric, positive definite system \p matrix (row by row, \p x.size() of them) times
/// x = \p x by Cholesky's factors, in place.
inline void solve_positive(std::span<double> matrix, std::span<double> x) {
  const std::size_t n = x.size();
  const auto at = [&](std::size_t i, std::size_t j) -> double& { return matrix[i * n + j]; };
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = at(i, j);
      for (std::size_t k = 0; k < j; ++k) sum -= at(i, k) * at(j, k);
      at(i, j) = i == j ? std::sqrt(sum) : sum / at(j, j);
    }
    for (std::size_t k = 0; k < i; ++k) x[i] -= at(i, k) * x[k];
    x[i] /= at(i, i);
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) x[i] -= at(k, i) * x[k];
    x[i] /= at(i, i);
  }
}

}  // namespace polyhull
