// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour/contourer.h"

#include "base/error.h"
#include "silhouette/contour/contourer_state.h"

namespace polyhull {

Contourer::Contourer() : state_(std::make_unique<State>()) {}
Contourer::~Contourer() = default;
Contourer::Contourer(Contourer&&) noexcept = default;
Contourer& Contourer::operator=(Contourer&&) noexcept = default;

const Rings& Contourer::State::finish(const ContourSettings& now) {
  valid = false;
  if (!(now.steadiness >= 0.0 && now.steadiness <= 10.0))
    throw Error(Error::Kind::bad_input, "The contours' steadiness is {:g}; give 0 to 10 px.",
                now.steadiness);
  tracer.finish(traced, &parents);
  const bool as_before = may_stay && settings == now;
  if (as_before && traced == last_traced) {
    stayed = true;  // an equal picture has equal contours
  } else if (!as_before || !keep_still(now)) {
    may_stay = false;
    stayed = false;
    approximator.approximate(traced, parents, now.approximate, rings);
    may_stay = now.steadiness > 0.0 && now.approximate.tolerance > 0.0;
    if (may_stay) steady.assign(traced, approximator.nodes());
  }
  std::swap(traced, last_traced);
  settings = now;
  valid = true;
  return rings;
}

// Makes the contours of what was traced, and of the last where nothing moved; false: nothing stays, or
// what stays and what is new do not go together.
bool Contourer::State::keep_still(const ContourSettings& now) {
  steady.splice(traced, static_cast<float>(now.steadiness), spliced, nodes);
  if (nodes.empty()) return false;
  if (!approximator.approximate(spliced, parents, now.approximate, next, nodes)) return false;
  steady.assign(spliced, approximator.nodes());
  stayed = next == rings;
  rings = next;
  return true;
}

const Rings& Contourer::find(const Field& field, const ContourSettings& settings) {
  state_->tracer.push_all(field, settings.trace);
  return state_->finish(settings);
}

const Rings& Contourer::find(const Matte& matte, const ContourSettings& settings) {
  load_field(matte, state_->unblurred);
  return find(state_->unblurred, settings);
}

bool Contourer::holds(const ContourSettings& settings) const {
  return state_->holds(settings);
}

bool Contourer::stayed() const {
  return state_->stayed;
}

const Rings& Contourer::contours() const {
  return state_->rings;
}

const ApproximateCounts& Contourer::counts() const {
  return state_->approximator.counts();
}

}  // namespace polyhull
