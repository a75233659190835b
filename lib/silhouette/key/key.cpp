// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/key/key.h"

#include <algorithm>
#include <atomic>
#include <climits>
#include <cmath>
#include <string>

#include "base/error.h"
#include "silhouette/key/key_state.h"

namespace polyhull {
namespace {

// False for NaN, too.
void within(double v, double low, double high, const char* name) {
  if (v >= low && v <= high) return;
  throw Error(Error::Kind::bad_input, "The key's {} is {:g}; give a value from {:g} to {:g}.", name,
              v, low, high);
}

void below(double low, double high, const char* low_name, const char* high_name) {
  if (low < high) return;
  throw Error(Error::Kind::bad_input,
              "The key's {} ({:g}) is not below its {} ({:g}); lower the one or raise the other.",
              low_name, low, high_name, high);
}

void check(const KeySettings& s) {
  within(s.strength, 0, 255, "strength");
  within(s.bright_threshold, 0, 765, "bright-threshold");
  within(s.red_gain, 0.0, 4.0, "red-gain");
  within(s.blue_gain, 0.0, 4.0, "blue-gain");
  within(s.clip_black, 0.0, 1.0, "clip-black");
  within(s.clip_white, 0.0, 1.0, "clip-white");
  below(s.clip_black, s.clip_white, "clip-black", "clip-white");
  within(s.choke, -32.0, 32.0, "choke");
  within(s.close, 0.0, 32.0, "close");
  within(s.spill, 0.0, 1.0, "spill");
  within(s.difference_low, 0.0, 442.0, "difference-low");
  within(s.difference_high, 0.0, 442.0, "difference-high");
  below(s.difference_low, s.difference_high, "difference-low", "difference-high");
  within(s.shadow_darkest, 0.0, 1.0, "shadow-darkest");
  within(s.light_brightest, 1.0, 4.0, "light-brightest");
  within(s.light_penalty, 0.0, 1.0, "light-penalty");
  within(s.roi.width, 0, INT_MAX, "region of interest's width");
  within(s.roi.height, 0, INT_MAX, "region of interest's height");
}

// What the samples taken from a picture depend on.
bool same_samples(const KeySettings& a, const KeySettings& b) {
  return a.method == b.method && a.key == b.key && a.colour == b.colour &&
         a.red_gain == b.red_gain && a.blue_gain == b.blue_gain && a.roi == b.roi &&
         a.screen == b.screen && a.foreground == b.foreground && a.plate == b.plate;
}

Rectangle clipped(const Rectangle& roi, int width, int height) {
  if (roi.empty()) return {0, 0, width, height};
  const int x0 = std::clamp(roi.x, 0, width), y0 = std::clamp(roi.y, 0, height);
  const int x1 =
      static_cast<int>(std::clamp<long long>(static_cast<long long>(roi.x) + roi.width, 0, width));
  const int y1 = static_cast<int>(
      std::clamp<long long>(static_cast<long long>(roi.y) + roi.height, 0, height));
  return {x0, y0, std::max(x1 - x0, 0), std::max(y1 - y0, 0)};
}

}  // namespace

Keyer::Keyer() : state_(std::make_unique<State>()) {}
Keyer::~Keyer() = default;
Keyer::Keyer(Keyer&&) noexcept = default;
Keyer& Keyer::operator=(Keyer&&) noexcept = default;

void Keyer::set(const KeySettings& settings) {
  check(settings);
  State& s = *state_;
  if (!same_samples(settings, s.settings)) s.found = false;
  s.settings = settings;
  s.fresh_settings = true;
}

const KeySettings& Keyer::settings() const {
  return state_->settings;
}

void Keyer::learn_plate(int frames) {
  State& s = *state_;
  s.learning = std::clamp(frames, 0, 100000);
  s.learned = 0;
  s.sums.clear();
}

void Keyer::recalibrate() {
  state_->found = false;
}

Rectangle Keyer::active() const {
  return state_->active;
}

bool Keyer::needs_plane() const {
  return state_->settings.choke != 0.0 || state_->settings.close != 0.0;
}

KeyCalibration Keyer::calibration() const {
  KeyCalibration out = state_->samples;
  out.plate_frames_left = state_->learning - state_->learned;
  out.lacks = state_->lack();
  return out;
}

KeyLack Keyer::State::lack() const {
  if (width == 0) return KeyLack::nothing;  // no frame yet
  if (method != KeyMethod::difference) return found ? KeyLack::nothing : KeyLack::screen;
  // A key colour or a screen given by hand says itself what the background is, and while the plate
  // is being learned there is none yet.
  const bool known = settings.plate || !learned_plate.empty() || settings.screen ||
                     settings.key == KeyColour::custom || learning > 0;
  return known ? KeyLack::nothing : KeyLack::plate;
}

void Keyer::prepare(const FrameView& frame) {
  check_frame(frame);
  State& s = *state_;
  static std::atomic<std::uint64_t> frames{0};
  s.frame_number = ++frames;
  s.gaps.clear();
  const bool same_frame = frame.format == s.format && frame.width == s.width &&
                          frame.height == s.height && frame.matrix == s.matrix &&
                          frame.full_range == s.full_range && frame.site == s.site &&
                          frame.bayer == s.bayer && frame.samples == s.layout;
  if (frame.width != s.width || frame.height != s.height) {
    s.learned_plate.clear();
    s.sums.clear();
    s.learned = 0;
  }
  if (!same_frame || s.light_came(frame)) s.found = false;
  if (!same_frame || s.fresh_settings || !s.found) s.lay_out(frame);
  s.follow_colours(frame);
  if (s.learning > 0) s.learn(frame);
  if (s.despills()) s.edges.begin(s.width, s.height);
  s.keyed.resize(s.width, s.height);
}

void Keyer::keyed_row(int y, int x0, int x1, std::uint8_t* alpha) const {
  const Matte& keyed = state_->keyed;
  const BlockState* const states = keyed.state_row(y);
  for (int x = x0; x < x1;) {
    const int block = x / matte_block, end = std::min((block + 1) * matte_block, x1);
    if (states[block] == block_mixed)
      std::copy(keyed.row(y) + x, keyed.row(y) + end, alpha + x);
    else
      std::fill(alpha + x, alpha + end, states[block] == block_full ? 255 : 0);
    x = end;
  }
}

void Keyer::State::lay_out(const FrameView& frame) {
  format = frame.format;
  width = frame.width;
  height = frame.height;
  matrix = frame.matrix;
  full_range = frame.full_range;
  site = frame.site;
  bayer = frame.bayer;
  layout = frame.samples;
  active = clipped(settings.roi, width, height);

  const bool any_hue =
      settings.key != KeyColour::custom || silhouette::saturation_of(settings.colour) >= 24;
  method = any_hue ? settings.method : KeyMethod::difference;
  const bool four_bytes = format == FrameFormat::rgbx || format == FrameFormat::bgrx ||
                          format == FrameFormat::rgba || format == FrameFormat::bgra;

  // Sampling needs signal, and finds the hue that the signal depends on.
  sample(frame);
  plain = silhouette::key_signal(key, hue, settings.red_gain, settings.blue_gain);
  calibrate();
  if (method == KeyMethod::difference)
    path = Path::converted;
  else if (four_bytes)
    path = Path::pixels;
  else if (is_yuv(format) && !is_ten_bit(format) && format != FrameFormat::described &&
           method == KeyMethod::soft && signal.chroma_only)
    path = Path::chroma;
  else
    path = Path::converted;
  whole = forms_for(frame, signal);

  if (method == KeyMethod::difference)
    lay_out_plate();
  else
    lay_out_screen();
  lay_out_masks();
  fresh_settings = false;
}

void Keyer::State::calibrate() {
  signal = plain;
  screen_level = samples.screen_signal;
  foreground_level = samples.foreground_signal;
  if (method != KeyMethod::soft || !samples.valid) return;
  const Vec3f screen = silhouette::vector_of(samples.screen);
  const Vec3f foreground = silhouette::vector_of(samples.foreground);
  signal = silhouette::calibrated(plain, screen, foreground, noise);
  screen_level = signal.of(screen);
  foreground_level = std::min(signal.of(foreground), screen_level);
}

void Keyer::State::lay_out_masks() {
  const std::size_t pixels = row_length() * static_cast<std::size_t>(height);
  const auto add = [&](const Picture& mask, const char* name, std::vector<std::uint8_t>& plane,
                       std::uint8_t value) {
    if (mask.width != width || mask.height != height)
      throw Error(Error::Kind::bad_input,
                  "{} mask is {}x{}, the frame {}x{}; give a mask of the frame's size.", name,
                  mask.width, mask.height, width, height);
    for (int y = 0; y < height; ++y) {
      std::uint8_t* out = plane.data() + row_length() * static_cast<std::size_t>(y);
      for (int x = 0; x < width; ++x)
        if (mask.row(y)[static_cast<std::size_t>(x) * mask.channels] != 0) out[x] = value;
    }
  };
  allowed.clear();
  forced.clear();
  if (!settings.outside_polygon.empty())
    silhouette::fill_polygon(settings.outside_polygon, width, height, allowed);
  if (settings.outside_mask) {
    if (allowed.empty()) allowed.assign(pixels, 255);
    add(*settings.outside_mask, "The outside", allowed, 0);
  }
  if (!settings.inside_polygon.empty())
    silhouette::fill_polygon(settings.inside_polygon, width, height, forced);
  if (settings.inside_mask) {
    if (forced.empty()) forced.assign(pixels, 0);
    add(*settings.inside_mask, "The inside", forced, 255);
  }
}

void Keyer::key(const FrameView& frame, Matte& matte) {
  prepare(frame);
  matte.resize(frame.width, frame.height);
  for (int y = 0; y < frame.height; ++y) key_row(frame, y, matte.row(y), matte.state_row(y));
  if (!needs_plane()) return;
  State& s = *state_;
  if (s.settings.close > 0.0) {
    s.gaps.open(matte);
    silhouette::grow(matte, s.settings.close, s.scratch);
    silhouette::grow(matte, -s.settings.close, s.scratch);
    s.gaps.close(matte, s.settings.close);
  }
  if (s.settings.choke != 0.0) silhouette::grow(matte, -s.settings.choke, s.scratch);
  if (s.despills()) s.edges.begin(s.width, s.height);
  // Growing must not leave the region of interest or the garbage mattes.
  for (int y = 0; y < frame.height; ++y) {
    std::uint8_t* row = matte.row(y);
    const bool inside_rows = y >= s.active.y && y < s.active.y + s.active.height;
    const int x0 = inside_rows ? s.active.x : 0;
    const int x1 = inside_rows ? s.active.x + s.active.width : 0;
    const std::uint8_t* allowed =
        s.allowed.empty() ? nullptr
                          : s.allowed.data() + s.row_length() * static_cast<std::size_t>(y);
    silhouette::limit_row(row, frame.width, x0, x1, allowed);
    find_states(row, frame.width, matte.state_row(y));
    if (s.despills()) s.edges.add_row(y, row, matte.state_row(y));
  }
}

}  // namespace polyhull
