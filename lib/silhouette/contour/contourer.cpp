// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour/contourer_state.h"

namespace polyhull {

Contourer::Contourer() : state_(std::make_unique<State>()) {}
Contourer::~Contourer() = default;
Contourer::Contourer(Contourer&&) noexcept = default;
Contourer& Contourer::operator=(Contourer&&) noexcept = default;

const Rings& Contourer::State::finish(const ContourSettings& now) {
  valid = false;
  tracer.finish(traced, &parents);
  approximator.approximate(traced, parents, now.approximate, rings);
  settings = now;
  valid = true;
  return rings;
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

const Rings& Contourer::contours() const {
  return state_->rings;
}

const ApproximateCounts& Contourer::counts() const {
  return state_->approximator.counts();
}

}  // namespace polyhull
