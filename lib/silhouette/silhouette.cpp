// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/silhouette.h"

#include <algorithm>
#include <cmath>

#include "silhouette/blur/blur_state.h"
#include "silhouette/contour/contourer_state.h"
#include "silhouette/pixels/chroma.h"

namespace polyhull {

double corrected_sigma(const BlurSettings& blur, bool correct_curvature) {
  return correct_curvature && blur.threshold == 0 ? blur.sigma : 0.0;
}

Rectangle bounding_rectangle(const Rings& rings, int width, int height) {
  if (rings.points.empty()) return {};
  Vec2f low = rings.points[0], high = low;
  for (const Vec2f p : rings.points) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  // Pixel x covers [x - 0.5, x + 0.5].
  const int x0 = std::max(static_cast<int>(std::floor(low.x + 0.5f)), 0);
  const int y0 = std::max(static_cast<int>(std::floor(low.y + 0.5f)), 0);
  const int x1 = std::min(static_cast<int>(std::ceil(high.x + 0.5f)), width);
  const int y1 = std::min(static_cast<int>(std::ceil(high.y + 0.5f)), height);
  return {x0, y0, std::max(x1 - x0, 0), std::max(y1 - y0, 0)};
}

struct Silhouetter::State {
  SilhouetteSettings settings;
  Keyer keyer;
  Blur::State blur;
  Contourer::State contours;
  Matte keyed;  // only where the matte needs its neighbours or the blur whole planes
  Field field;
  bool streamed = false;  // the last frame: its matte is the keyer's
  Matte row;
  SilhouetteStats stats;

  // Reuse: rows of the last frame are compared first; only when they were equal once is a frame
  // copied, so that moving pictures cost nothing.
  bool copy_valid = false;
  std::uint64_t last_probe = 0;
  FrameView last_layout;  // its pixels may be gone
  FrameCopy last;

  void stream(const FrameView& frame, const TraceSettings& trace);
  void planes(const FrameView& frame, const TraceSettings& trace);
  bool unchanged(const FrameView& frame, bool& worth_copying);
};

Silhouetter::Silhouetter() : state_(std::make_unique<State>()) {}
Silhouetter::~Silhouetter() = default;
Silhouetter::Silhouetter(Silhouetter&&) noexcept = default;
Silhouetter& Silhouetter::operator=(Silhouetter&&) noexcept = default;

void Silhouetter::set(const SilhouetteSettings& settings) {
  State& s = *state_;
  // Who is set lays out its tables anew.
  if (settings.key != s.keyer.settings()) s.keyer.set(settings.key);
  if (settings.blur != s.blur.settings) s.blur.set(settings.blur);
  s.settings = settings;
  s.contours.valid = false;
}

const SilhouetteSettings& Silhouetter::settings() const {
  return state_->settings;
}

Keyer& Silhouetter::keyer() {
  state_->contours.valid = false;
  return state_->keyer;
}

const Keyer& Silhouetter::keyer() const {
  return state_->keyer;
}

const SilhouetteStats& Silhouetter::stats() const {
  return state_->stats;
}

bool Silhouetter::State::unchanged(const FrameView& frame, bool& worth_copying) {
  worth_copying = false;
  if (!settings.reuse) return false;
  const bool same = same_layout(frame, last_layout);
  last_layout = frame;
  if (!same) {  // the region still is that of the frame before
    copy_valid = false;
    last_probe = 0;
    return false;
  }
  const std::uint64_t probe = hash_of_some_rows(frame, keyer.active());
  const bool same_probe = probe == last_probe;
  last_probe = probe;
  if (!same_probe) {
    copy_valid = false;
    return false;
  }
  if (contours.valid && copy_valid && same_pixels(frame, last.view(), keyer.active())) return true;
  worth_copying = true;
  return false;
}

namespace {

// The bytes that keying row y's active columns reads first are asked for.
void ask_for(const FrameView& frame, const Rectangle& active, int y, silhouette::RowAhead& ahead) {
  if (y < active.y || y >= active.y + active.height) return;
  const auto ask = [&](int plane, int row, int columns) {
    const std::ptrdiff_t stride = frame.strides[plane];
    if (stride <= 0) return;
    const std::uint8_t* const begin = frame.row(plane, row);
    ahead.begin(begin + stride * active.x / columns,
                begin + stride * (active.x + active.width) / columns);
  };
  if (!halved_down(frame) || frame.format == FrameFormat::described) return ask(0, y, frame.width);
  // Hardly more than the chroma is read: every second row needs one that no row before did.
  const silhouette::ChromaRows rows = silhouette::chroma_rows(frame, y);
  if (frame.format == FrameFormat::nv12 && rows.far_row > rows.near_row)
    ask(1, rows.far_row, frame.width);
}

}  // namespace

void Silhouetter::State::stream(const FrameView& frame, const TraceSettings& trace) {
  keyer.prepare(frame);
  blur.begin(frame.width, frame.height, Tracer::State::rows_kept(trace));
  contours.tracer.begin(frame.width, frame.height, trace);
  Blur::State::Row row;
  silhouette::RowAhead ahead;
  for (int y = 0; y < frame.height; ++y) {
    keyer.key_row(frame, y, blur.next_alpha(), blur.next_states(), settings.keep_matte);
    ask_for(frame, keyer.active(), y + 1, ahead);
    ahead.some();
    blur.push();
    while (blur.pull(row, &ahead)) {
      ahead.some();
      contours.tracer.push(row.values, row.states, &ahead);
    }
    ahead.rest();
  }
}

void Silhouetter::State::planes(const FrameView& frame, const TraceSettings& trace) {
  keyer.key(frame, keyed);
  blur.apply(keyed, field);
  contours.tracer.push_all(field, trace);
}

const Rings& Silhouetter::process(const FrameView& frame) {
  State& s = *state_;
  check_frame(frame);
  ++s.stats.frames;
  bool worth_copying = false;
  const bool learning = s.keyer.calibration().plate_frames_left > 0;
  if (!learning && s.unchanged(frame, worth_copying)) {
    ++s.stats.reused;
    return s.contours.rings;
  }
  s.contours.valid = false;
  const ContourSettings settings{
      {s.settings.method, corrected_sigma(s.settings.blur, s.settings.correct_curvature)},
      s.settings.approximate,
      s.settings.steadiness};
  s.streamed = !s.keyer.needs_plane() && s.blur.streams();
  if (s.streamed)
    s.stream(frame, settings.trace);
  else
    s.planes(frame, settings.trace);
  const Rings& rings = s.contours.finish(settings);
  s.stats.last = s.contours.approximator.counts();
  if (s.contours.stayed) ++s.stats.steady;
  if (rings.empty()) ++s.stats.empty;
  // Without a valid calibration the next frame may be keyed differently although it is equal.
  s.contours.valid = !learning;
  s.copy_valid = worth_copying;
  if (worth_copying) s.last.assign(frame, s.keyer.active());
  return rings;
}

void Silhouetter::write_rgba(const FrameView& frame, const Rectangle& region, std::uint8_t* rgba,
                             std::ptrdiff_t stride) const {
  State& s = *state_;
  if (!s.streamed)
    return s.keyer.write_rgba(frame, s.keyed, region, KeyView::composite, rgba, stride);
  s.row.resize(frame.width, 1);
  s.row.stride = 0;  // every row is this one
  for (int j = 0; j < region.height; ++j) {
    const int y = region.y + j;
    s.keyer.keyed_row(y, region.x, region.x + region.width, s.row.row(0));
    s.keyer.write_rgba(frame, s.row, {region.x, y, region.width, 1}, KeyView::composite,
                       rgba + stride * j, stride);
  }
}

}  // namespace polyhull
