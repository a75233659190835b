// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which of the views that see a point are blended; shaders/hull.frag has the same.
#pragma once

#include <cstddef>

namespace polyhull::processor {

/// Keeps the \p best largest of \p count weights (a multiple of four, at most most_candidates, none
/// negative), less the weight l of the first one that is left out: w becomes max(0, w - l). What
/// enters and leaves the chosen few does so at weight zero, and the blend stays continuous (Buehler
/// et al. 2001). But for a thousandth of the largest: l is at most .999 of it, so that views that
/// weigh alike do not leave nothing.
void keep_best_views(float* weights, std::size_t count, int best);

}  // namespace polyhull::processor
