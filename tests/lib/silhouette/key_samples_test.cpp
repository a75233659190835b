// SPDX-License-Identifier: LGPL-2.1-or-later
// The calibrated soft matte: what is sampled from a picture, and what comes of it.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "key_checks.h"

namespace polyhull {
namespace {

using test::area_of;
using test::Colour;
using test::disk_scene;
using test::key;
using test::mix;
using test::rgb;
using test::screen_green;
using test::skin;

TEST(KeySamples, SoftMatteIsLinearInTheMixingFraction) {
  // Column 60 + x shows the foreground to x / 24, those beside one of the two alone. Red is the larger
  // of the other channels in both colours, so the signal has no kink.
  static constexpr Colour screen{70, 190, 60}, subject{190, 130, 130};
  const auto share = [](int x) { return std::clamp((x - 60) / 24.0, 0.0, 1.0); };
  const auto colour = [&](int x, int) { return mix(screen, subject, share(x)); };
  KeySettings settings;
  settings.screen = rgb(screen);
  settings.foreground = rgb(subject);
  settings.clip_black = 0.0;
  settings.clip_white = 1.0;
  const auto check = [&](const test::Frame& frame, const std::string& what) {
    const Matte m = key(settings, frame.view);
    for (int x = 0; x < 161; ++x)
      ASSERT_NEAR(m.row(4)[x], 255.0 * share(x), 8.0) << what << " " << x;
  };
  for (const FrameFormat format : test::all_formats)
    check(test::make_frame(format, 161, 8, colour), name_of(format));
  for (const ColourMatrix matrix : {ColourMatrix::bt601, ColourMatrix::bt709, ColourMatrix::bt2020})
    for (const bool full : {false, true})
      check(test::make_frame(FrameFormat::nv12, 161, 8, colour, matrix, full), "NV12");
}

TEST(KeySamples, ClipsStretchWhatIsBetween) {
  static constexpr Colour screen{70, 190, 60}, subject{190, 130, 130};
  const test::Frame frame = test::make_frame(
      FrameFormat::rgbx, 101, 4, [](int x, int) { return mix(screen, subject, x / 100.0); });
  KeySettings settings;
  settings.screen = rgb(screen);
  settings.foreground = rgb(subject);
  for (const auto& [black, white] : {std::pair{0.0, 1.0}, {0.2, 0.8}, {0.0, 0.5}, {0.6, 1.0}}) {
    settings.clip_black = black;
    settings.clip_white = white;
    const Matte m = key(settings, frame.view);
    for (int x = 0; x <= 100; ++x) {
      const double alpha = 255.0 * std::clamp((x / 100.0 - black) / (white - black), 0.0, 1.0);
      // Whole blocks of 16 within 3 % of an end are silenced.
      const bool end = alpha < 12.0 || alpha > 243.0;
      ASSERT_NEAR(m.row(1)[x], alpha, end ? 12.0 : 2.5 / (white - black))
          << black << " to " << white << " at " << x;
    }
  }
}

TEST(KeySamples, SamplesThePictureItself) {
  for (const FrameFormat format : test::all_formats) {
    const test::Frame frame = test::make_frame(format, 121, 91, disk_scene);
    Keyer keyer;
    keyer.set({});
    Matte m;
    keyer.key(frame.view, m);
    const KeyCalibration c = keyer.calibration();
    EXPECT_TRUE(c.valid);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(c.screen[i], screen_green[i], 3.0) << name_of(format);
      EXPECT_NEAR(c.foreground[i], skin[i], 5.0) << name_of(format);
    }
    EXPECT_EQ(m.row(45)[60], 255);
    EXPECT_EQ(m.row(2)[2], 0);
    EXPECT_NEAR(area_of(m), M_PI * 30.0 * 30.0, 40.0) << name_of(format);
  }
}

TEST(KeySamples, FindsTheScreenColour) {
  for (const Colour& screen :
       {Colour{60, 190, 70}, Colour{40, 70, 190}, Colour{200, 60, 180}, Colour{190, 180, 60}}) {
    const auto colour = [&](int x, int y) {
      return mix(screen, {120, 118, 122},
                 std::clamp(30.5 - std::hypot(x - 60.0, y - 45.0), 0.0, 1.0));
    };
    const test::Frame frame = test::make_frame(FrameFormat::bgrx, 121, 91, colour);
    KeySettings settings;
    settings.key = KeyColour::automatic;
    EXPECT_NEAR(area_of(key(settings, frame.view)), M_PI * 30.0 * 30.0, 40.0) << screen[0];
    settings.key = KeyColour::custom;
    settings.colour = rgb(screen);
    EXPECT_NEAR(area_of(key(settings, frame.view)), M_PI * 30.0 * 30.0, 40.0) << screen[0];
    // Green and blue find their own screen only; before another all is foreground.
    for (const KeyColour hue : {KeyColour::green, KeyColour::blue}) {
      settings.key = hue;
      const bool own =
          hue == KeyColour::green ? screen[1] == 190 && screen[0] == 60 : screen[2] == 190;
      EXPECT_NEAR(area_of(key(settings, frame.view)), own ? M_PI * 30.0 * 30.0 : 121.0 * 91.0, 40.0)
          << screen[0] << " hue " << int(hue);
    }
  }
}

TEST(KeySamples, WithoutAScreenEverythingIsForeground) {
  const test::Frame frame = test::make_frame(FrameFormat::rgbx, 50, 40, [](int x, int) {
    return Colour{x * 4.0, x * 3.0, 90};
  });
  Keyer keyer;
  keyer.set({});
  Matte m;
  keyer.key(frame.view, m);
  EXPECT_FALSE(keyer.calibration().valid);
  EXPECT_EQ(area_of(m), 50.0 * 40.0);
  // The screen that comes later is found.
  const test::Frame later =
      test::make_frame(FrameFormat::rgbx, 50, 40, [](int, int) { return screen_green; });
  keyer.key(later.view, m);
  EXPECT_TRUE(keyer.calibration().valid);
  EXPECT_EQ(area_of(m), 0.0);
}

// Rooms without a screen have tints, too.
TEST(KeySamples, FaintTintsAreNoScreen) {
  for (const KeyColour colour : {KeyColour::green, KeyColour::blue, KeyColour::automatic})
    for (int tint = 0; tint <= 40; ++tint)
      for (const int grain : {0, 1, 5}) {
        const auto paint = [&](int x, int y) {
          const double g = grain * ((x * 7 + y * 13) % 5 - 2.0);
          Colour c{100 + g, 100 + g, 100 + g};
          c[colour == KeyColour::blue ? 2 : 1] += tint;
          return c;
        };
        KeySettings settings;
        settings.key = colour;
        const Matte m = key(settings, test::make_frame(FrameFormat::rgbx, 64, 48, paint).view);
        // All is screen or all is subject, whatever the tint.
        const int level = m.row(0)[0];
        EXPECT_TRUE(level == 0 || level == 255) << tint << " " << level;
        if (tint <= 8) {
          EXPECT_EQ(level, 255) << tint;
        } else if (tint >= 30) {
          EXPECT_EQ(level, 0) << tint;
        }
      }
}

TEST(KeySamples, AScreenSampledInTheDarkIsSampledAgainWhenTheLightComes) {
  const auto frame_in = [](FrameFormat format, double light, bool lamp = false) {
    return test::make_frame(format, 160, 90, [=](int x, int y) {
      const double cover = std::clamp(25.5 - std::hypot(x - 80.0, y - 45.0), 0.0, 1.0);
      // A lamp lights a corner of the screen.
      const double l = lamp && x < 40 && y < 30 ? 1.0 : light;
      return mix({40 * l, 180 * l, 60 * l}, {150 * l, 120 * l, 100 * l}, cover);
    });
  };
  const auto matte_of = [](Keyer& keyer, const test::Frame& frame) {
    Matte matte;
    keyer.key(frame.view, matte);
    return matte.values;
  };
  for (const FrameFormat format : {FrameFormat::rgbx, FrameFormat::nv12, FrameFormat::i420_10le})
    for (const KeyColour colour : {KeyColour::automatic, KeyColour::green}) {
      KeySettings settings;
      settings.key = colour;
      Keyer late, fresh;
      late.set(settings);
      fresh.set(settings);
      for (const double light : {0.2, 0.3, 0.5}) matte_of(late, frame_in(format, light));
      const test::Frame lit = frame_in(format, 1.0);
      for (int frame = 0; frame < 4; ++frame) matte_of(late, lit);
      EXPECT_EQ(matte_of(late, lit), matte_of(fresh, lit)) << name_of(format);
      // One lamp, and light that goes, change no sample.
      Keyer dim;
      dim.set(settings);
      matte_of(dim, frame_in(format, 0.5));
      const KeyCalibration before = dim.calibration();
      matte_of(dim, frame_in(format, 0.5, true));
      // Nor do flashes.
      for (int flash = 0; flash < 5; ++flash) {
        matte_of(dim, lit);
        matte_of(dim, frame_in(format, 0.5));
      }
      EXPECT_EQ(dim.calibration().screen_signal, before.screen_signal);
      matte_of(late, frame_in(format, 0.4));
      EXPECT_EQ(late.calibration().screen_signal, fresh.calibration().screen_signal);
    }
  // A screen whose colour is given stays as given.
  KeySettings given;
  given.screen = Rgb{20, 90, 30};
  Keyer keyer;
  keyer.set(given);
  matte_of(keyer, frame_in(FrameFormat::rgbx, 0.5));
  matte_of(keyer, frame_in(FrameFormat::rgbx, 1.0));
  EXPECT_EQ(keyer.calibration().screen, *given.screen);
}

TEST(KeySamples, UnevenScreen) {
  // Light falls off to a third across the picture.
  const auto light = [](int x) { return 1.0 - 0.65 * x / 320.0; };
  const auto cover = [](int x, int y) {
    return std::clamp(40.5 - std::hypot(x - 160.0, y - 90.0), 0.0, 1.0);
  };
  const auto colour = [&](int x, int y) {
    const double l = light(x);
    return mix({60 * l, 190 * l, 70 * l}, {90, 80, 85}, cover(x, y));
  };
  const test::Frame frame = test::make_frame(FrameFormat::bgrx, 320, 180, colour);
  const auto error = [&](const KeySettings& settings) {
    const Matte m = key(settings, frame.view);
    double sum = 0.0;
    for (int y = 0; y < 180; ++y)
      for (int x = 0; x < 320; ++x) sum += std::abs(m.row(y)[x] / 255.0 - cover(x, y));
    return sum / 320 / 180;
  };
  KeySettings settings;
  settings.clip_black = 0.0;
  settings.clip_white = 1.0;
  const double followed = error(settings);
  auto plate = std::make_shared<Picture>(Picture{320, 180, 3, {}});
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 320; ++x)
      for (const double c : {60.0, 190.0, 70.0})
        plate->pixels.push_back(static_cast<std::uint8_t>(c * light(x)));
  settings.plate = plate;
  const double with_plate = error(settings);
  // The same plate, learned from frames of the empty stage.
  const test::Frame stage = test::make_frame(FrameFormat::bgrx, 320, 180, [&](int x, int) {
    return Colour{60 * light(x), 190 * light(x), 70 * light(x)};
  });
  settings.plate = nullptr;
  Keyer keyer;
  keyer.set(settings);
  keyer.learn_plate(3);
  for (int i = 0; i < 3; ++i) keyer.prepare(stage.view);
  Matte learned;
  keyer.key(frame.view, learned);
  double with_learned = 0.0;
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 320; ++x)
      with_learned += std::abs(learned.row(y)[x] / 255.0 - cover(x, y)) / 320 / 180;
  std::printf("mean alpha error on an uneven screen: %.5f, clean plate %.5f, learned %.5f\n",
              followed, with_plate, with_learned);
  EXPECT_LT(followed, 0.0025);
  EXPECT_LT(with_plate, 0.001);
  EXPECT_LT(with_learned, 0.004);
}

// A subject whose least solid parts stay below alpha 1: they are made solid without showing in
// which blocks of 16 pixels that was done.
TEST(KeySamples, ANearlySolidSubjectShowsNoBlocks) {
  static constexpr Colour screen{60, 190, 70}, cloth{90, 80, 85};
  const auto tint = [](int x, int y) {
    return 0.10 + 0.06 * std::sin(x * 0.11) * std::cos(y * 0.13);
  };
  for (const FrameFormat format : test::all_formats) {
    const test::Frame frame = test::make_frame(format, 250, 120, [&](int x, int y) {
      if (x < 70) return screen;
      return mix(cloth, screen, y < 60 ? tint(x, y) : 0.0);
    });
    const Matte m = key({}, frame.view);
    int largest = 0;
    for (int y = 0; y < 56; ++y) {
      for (int x = 82; x < 250; ++x) {
        largest = std::max(largest, std::abs(m.row(y)[x] - m.row(y)[x - 1]));
        ASSERT_GE(m.row(y)[x], 200) << name_of(format) << " at " << x << "," << y;
      }
      for (int x = 0; x < 66; ++x) ASSERT_EQ(m.row(y)[x], 0) << x << "," << y;
      std::vector<BlockState> states(blocks_across(250));
      find_states(m.row(y), 250, states.data());
      for (int i = 0; i < blocks_across(250); ++i) ASSERT_EQ(m.state_row(y)[i], states[i]) << i;
    }
    EXPECT_LE(largest, 9) << name_of(format);
    std::printf("%s: largest step inside the subject %d\n", name_of(format), largest);
  }
}

TEST(KeySamples, AGivenScreenIsAsQuietAsASampledOne) {
  // Uneven and noisy: what the screen spreads around the colour given is measured all the same.
  std::mt19937 random(8);
  std::normal_distribution<double> noise(0.0, 5.0);
  const auto cover = [](int x, int y) {
    return std::clamp(30.5 - std::hypot(x - 60.0, y - 45.0), 0.0, 1.0);
  };
  const test::Frame frame = test::make_frame(FrameFormat::bgrx, 121, 91, [&](int x, int y) {
    const double light = 1.0 + 0.08 * std::sin(x * 0.05);
    Colour c = mix({60 * light, 190 * light, 70 * light}, skin, cover(x, y));
    for (double& v : c) v += noise(random);
    return c;
  });
  const auto error = [&](const KeySettings& settings) {
    const Matte m = key(settings, frame.view);
    double sum = 0.0;
    for (int y = 0; y < 91; ++y)
      for (int x = 0; x < 121; ++x) sum += std::abs(m.row(y)[x] / 255.0 - cover(x, y));
    return sum / 121 / 91;
  };
  const double sampled = error({});
  KeySettings settings;
  settings.screen = rgb(screen_green);
  const double given = error(settings);
  std::printf("mean alpha error, screen sampled %.5f, given %.5f\n", sampled, given);
  EXPECT_LT(given, 1.2 * sampled);
}

// However noisy it is, the screen keys out, and only it.
TEST(KeySamples, ANoisyScreenKeysOut) {
  const struct {
    double noise, left;  // levels; per cent of the screen
  } bars[] = {{3.0, 0.5}, {6.0, 1.2}, {12.0, 5.0}};
  for (const auto& bar : bars) {
    std::mt19937 random(8);
    std::normal_distribution<double> noise(0.0, bar.noise);
    const test::Frame frame = test::make_frame(FrameFormat::bgrx, 321, 241, [&](int x, int y) {
      Colour c = std::hypot(x - 160.0, y - 120.0) < 60.0 ? skin : screen_green;
      for (double& v : c) v += noise(random);
      return c;
    });
    const Matte m = key({}, frame.view);
    int left = 0, screen = 0;
    for (int y = 0; y < 241; ++y)
      for (int x = 0; x < 321; ++x)
        if (std::hypot(x - 160.0, y - 120.0) > 64.0) {
          ++screen;
          left += m.row(y)[x] > 0;
        }
    EXPECT_LT(100.0 * left / screen, bar.left) << bar.noise;
  }
}

// A screen whose hue lies where directions begin and end.
TEST(KeySamples, EveryHueIsFoundWhole) {
  std::mt19937 random(8);
  std::normal_distribution<double> noise(0.0, 6.0);
  for (const Colour& screen : {Colour{60, 190, 190}, Colour{190, 60, 60}, Colour{60, 190, 70}}) {
    const test::Frame frame = test::make_frame(FrameFormat::bgrx, 321, 241, [&](int x, int y) {
      Colour c = std::hypot(x - 160.0, y - 120.0) < 60.0 ? Colour{120, 118, 122} : screen;
      for (double& v : c) v += noise(random);
      return c;
    });
    const auto signal = [&](const KeySettings& settings) {
      Keyer keyer;
      keyer.set(settings);
      Matte m;
      keyer.key(frame.view, m);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(keyer.calibration().screen[i], screen[i], 1.0);
      return keyer.calibration().screen_signal;
    };
    EXPECT_NEAR(signal({.key = KeyColour::automatic}),
                signal({.key = KeyColour::custom, .colour = rgb(screen)}), 1.5)
        << screen[0];
  }
}

TEST(KeySamples, RealPicturesWithHandCutAlpha) {
  const char* data = std::getenv("POLYHULL_DATA");
  const std::string folder = std::string(data ? data : "") + "/greenscreen/";
  if (!data || !std::ifstream(folder + "toy_train1_green.png"))
    GTEST_SKIP() << "no " << folder << "toy_train1_green.png";
  double soft_sum = 0.0, prototype_best_sum = 0.0;
  for (const std::string name : {"toy_train1", "toy_train2"}) {
    const Picture picture = load_picture(folder + name + "_green.png", 3);
    const Picture truth = load_picture(folder + name + "_alpha.png", 4);
    const test::Frame frame =
        test::make_frame(FrameFormat::rgbx, picture.width, picture.height, [&](int x, int y) {
          const std::uint8_t* p = picture.row(y) + 3 * x;
          return Colour{double(p[0]), double(p[1]), double(p[2])};
        });
    const auto error = [&](const KeySettings& settings) {
      const Matte m = key(settings, frame.view);
      double sum = 0.0;
      for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x)
          sum += std::abs(m.row(y)[x] - truth.row(y)[4 * x + 3]) / 255.0;
      return sum / picture.width / picture.height;
    };
    const double soft = error({});
    KeySettings settings;
    settings.key = KeyColour::automatic;
    const double automatic = error(settings);
    EXPECT_LT(soft, name == "toy_train1" ? 0.0042 : 0.006);

    // Colours a person might give, out of the parts that the truth calls subject or screen: by how
    // green they are, from the least to the most.
    const auto colour_at = [&](bool subject, double quantile) {
      std::vector<std::pair<int, Rgb>> found;
      for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
          const int alpha = truth.row(y)[4 * x + 3];
          const std::uint8_t* p = picture.row(y) + 3 * x;
          if (alpha == (subject ? 255 : 0))
            found.push_back({p[1] - std::max(p[0], p[2]), {p[0], p[1], p[2]}});
        }
      std::sort(found.begin(), found.end());
      const std::size_t around = found.size() / 50;
      const auto middle =
          static_cast<std::size_t>(quantile * static_cast<double>(found.size() - 1));
      double sum[3] = {}, n = 0.0;
      for (std::size_t i = middle - std::min(middle, around);
           i < std::min(middle + around, found.size()); ++i, n += 1.0)
        for (int c = 0; c < 3; ++c) sum[c] += found[i].second[c];
      return Rgb{static_cast<std::uint8_t>(sum[0] / n), static_cast<std::uint8_t>(sum[1] / n),
                 static_cast<std::uint8_t>(sum[2] / n)};
    };
    // What docs/keying.md advises against is worse: a subject's part that reflects the screen, the
    // screen's most colourful part.
    std::vector<double> foregrounds, screens;
    for (const double quantile : {0.25, 0.5, 0.9, 0.97}) {
      settings = {};
      settings.foreground = colour_at(true, quantile);
      foregrounds.push_back(error(settings));
    }
    for (const double quantile : {0.1, 0.5, 0.9}) {
      settings = {};
      settings.screen = colour_at(false, quantile);
      screens.push_back(error(settings));
      EXPECT_LT(screens.back(), 2.0 * soft) << "screen at " << quantile;
    }
    EXPECT_LT(soft, 0.8 * foregrounds[3]);
    std::printf("%s given, from the least to the most green: foreground", name.c_str());
    for (const double e : foregrounds) std::printf(" %.4f", e);
    std::printf(", screen");
    for (const double e : screens) std::printf(" %.4f", e);
    std::printf("\n");

    settings = {};
    settings.method = KeyMethod::threshold;
    const double prototype = error(settings);
    double best = 1.0;
    int best_strength = 0;
    for (int strength = 5; strength < 120; strength += 5) {
      settings.strength = strength;
      if (error(settings) < best) best = error(settings), best_strength = strength;
    }
    std::printf(
        "%s mean absolute alpha error: soft %.4f, key=auto %.4f, prototype %.4f (best "
        "at strength %d: %.4f)\n",
        name.c_str(), soft, automatic, prototype, best_strength, best);
    EXPECT_LT(soft, prototype);
    soft_sum += soft;
    prototype_best_sum += best;
  }
  std::printf("mean: soft %.4f, prototype at its best strength %.4f\n", soft_sum / 2,
              prototype_best_sum / 2);
}

}  // namespace
}  // namespace polyhull
