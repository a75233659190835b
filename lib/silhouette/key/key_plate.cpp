// SPDX-License-Identifier: LGPL-2.1-or-later
// The clean plate: given, learned from frames, or one colour.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "silhouette/key/key_state.h"

namespace polyhull {

void Keyer::State::lay_out_plate() {
  difference.darkest = static_cast<float>(settings.shadow_darkest);
  difference.brightest = static_cast<float>(settings.light_brightest);
  difference.low = static_cast<float>(settings.difference_low);
  difference.slope =
      static_cast<float>(255.0 / (settings.difference_high - settings.difference_low));
  difference.light_penalty = static_cast<float>(settings.light_penalty);

  const std::size_t length = row_length();
  plate.assign(4 * length * static_cast<std::size_t>(height), 0);
  if (!learned_plate.empty()) {
    for (int y = 0; y < height; ++y)
      std::copy_n(learned_plate.data() + 4 * static_cast<std::size_t>(y) * width,
                  4 * static_cast<std::size_t>(width),
                  plate.data() + 4 * length * static_cast<std::size_t>(y));
    return;
  }
  if (settings.plate) {
    const Picture& p = *settings.plate;
    if (p.width != width || p.height != height)
      throw Error(Error::Kind::bad_input,
                  "The clean plate is {}x{}, the frame {}x{}; give a plate of the frame's size.",
                  p.width, p.height, width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const std::uint8_t* from = p.row(y) + static_cast<std::size_t>(x) * p.channels;
        std::uint8_t* to = plate.data() + 4 * (length * static_cast<std::size_t>(y) + x);
        for (int c = 0; c < 3; ++c) to[c] = from[p.channels >= 3 ? c : 0];
      }
    return;
  }
  Rgb colour = settings.colour;
  if (settings.key == KeyColour::green) colour = {0, 255, 0};
  if (settings.key == KeyColour::blue) colour = {0, 0, 255};
  if (settings.screen) colour = *settings.screen;
  for (std::size_t i = 0; i < plate.size(); i += 4)
    for (int c = 0; c < 3; ++c) plate[i + c] = colour[c];
}

void Keyer::State::learn(const FrameView& frame) {
  const std::size_t row_values = 6 * static_cast<std::size_t>(width);
  if (learned == 0) sums.assign(row_values * static_cast<std::size_t>(height), 0.0f);
  std::vector<std::uint8_t> row(4 * static_cast<std::size_t>(width));
  for (int y = 0; y < height; ++y) {
    convert_row(frame, y, 0, width, row.data());
    float* sum = sums.data() + row_values * static_cast<std::size_t>(y);
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c) {
        const float v = row[4 * x + c];
        sum[6 * x + c] += v;
        sum[6 * x + 3 + c] += v * v;
      }
  }
  if (++learned < learning) return;

  const float n = static_cast<float>(learned);
  learned_plate.resize(4 * static_cast<std::size_t>(width) * height);
  for (std::size_t i = 0; i < learned_plate.size() / 4; ++i) {
    float variance = 0.0f;
    for (int c = 0; c < 3; ++c) {
      const float mean = sums[6 * i + c] / n;
      learned_plate[4 * i + c] = static_cast<std::uint8_t>(mean + 0.5f);
      variance += std::max(sums[6 * i + 3 + c] / n - mean * mean, 0.0f);
    }
    // Twice what the pixel itself did while nobody was there.
    learned_plate[4 * i + 3] =
        static_cast<std::uint8_t>(std::min(2.0f * std::sqrt(variance), 255.0f));
  }
  learning = learned = 0;
  sums.clear();
  sums.shrink_to_fit();
  fresh_settings = true;
}

}  // namespace polyhull
