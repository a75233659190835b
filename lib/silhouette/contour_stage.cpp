// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour_stage.h"

namespace polyhull {

const Rings& ContourStage::find(const MatteContent& content, const Settings& settings, bool reuse) {
  const bool known = before_.matte != nullptr || before_.field != nullptr;
  reused_ = reuse && known && settings == settings_ && same_content(content, before_);
  if (reused_) return rings_;

  if (content.field != nullptr) {
    tracer_.trace(*content.field, settings.trace, traced_, &parents_);
  } else {
    load_field(*content.matte, unblurred_);
    tracer_.trace(unblurred_, settings.trace, traced_, &parents_);
  }
  approximator_.approximate(traced_, parents_, settings.approximate, rings_);
  settings_ = settings;
  before_ = reuse ? content : MatteContent{};
  return rings_;
}

void ContourStage::reset() {
  before_ = {};
}

}  // namespace polyhull
