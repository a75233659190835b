// SPDX-License-Identifier: LGPL-2.1-or-later
/// Error of the matte on real photographs with a hand-cut alpha, for each way to key. Usage:
/// silhouette_stills FOLDER [DATA]; writes silhouette_stills.csv, and the mattes as pictures.
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "base/picture.h"
#include "benchmarks/measure.h"
#include "silhouette/key/key.h"

using namespace polyhull;
using namespace polyhull::benchmark;

namespace {

struct Way {
  const char* name;
  KeySettings settings;
};

std::vector<Way> ways() {
  std::vector<Way> result;
  KeySettings prototype;
  prototype.method = KeyMethod::threshold;
  result.push_back({"prototype strength 30", prototype});
  prototype.strength = 15;
  result.push_back({"prototype strength 15", prototype});
  prototype.strength = 50;
  result.push_back({"prototype strength 50", prototype});
  result.push_back({"soft (default)", {}});
  KeySettings automatic;
  automatic.key = KeyColour::automatic;
  result.push_back({"soft key=auto", automatic});
  KeySettings unclipped;
  unclipped.clip_black = 0.0;
  unclipped.clip_white = 1.0;
  result.push_back({"soft not clipped", unclipped});
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : ".";
  const char* environment = std::getenv("POLYHULL_DATA");
  const std::string data = std::string(argc > 2                 ? argv[2]
                                       : environment != nullptr ? environment
                                                                : ".") +
                           "/greenscreen";
  if (!std::filesystem::exists(data + "/toy_train1_green.png")) {
    std::printf("left out: %s is not here\n", data.c_str());
    return 77;
  }
  Table table(folder + "/silhouette_stills.csv",
              "picture,way,mean absolute alpha error,share wrong by more than half");
  Table bars(folder + "/silhouette_stills_bars.csv", "bar,asked,measured,held");
  for (const char* name : {"toy_train1", "toy_train2"}) {
    const Picture photo = load_picture(data + "/" + name + "_green.png", 4);
    const Picture truth = load_picture(data + "/" + name + "_alpha.png", 4);
    FrameView frame;
    frame.format = FrameFormat::rgba;
    frame.width = photo.width;
    frame.height = photo.height;
    frame.planes[0] = photo.pixels.data();
    frame.strides[0] = photo.width * 4;
    double best_prototype = 1e9, soft = 0.0, default_prototype = 0.0;
    for (const Way& way : ways()) {
      Keyer keyer;
      keyer.set(way.settings);
      Matte matte;
      keyer.key(frame, matte);
      double sum = 0.0;
      int wrong = 0;
      Picture picture{photo.width, photo.height, 1, {}};
      for (int y = 0; y < photo.height; ++y) {
        for (int x = 0; x < photo.width; ++x) {
          const int error = std::abs(matte.row(y)[x] - truth.row(y)[x * 4 + 3]);
          sum += error / 255.0;
          wrong += error > 127;
          picture.pixels.push_back(matte.row(y)[x]);
        }
      }
      const double count = static_cast<double>(photo.width) * photo.height;
      const double mean = sum / count;
      table.row("%s,%s,%.4f,%.4f", name, way.name, mean, wrong / count);
      if (way.settings.method == KeyMethod::threshold)
        best_prototype = std::min(best_prototype, mean);
      if (std::string(way.name) == "prototype strength 30") default_prototype = mean;
      if (std::string(way.name) == "soft (default)") soft = mean;
      std::string file = std::string(name) + "_" + way.name + ".png";
      for (char& c : file) c = c == ' ' || c == '(' || c == ')' || c == '=' ? '-' : c;
      save_picture(picture, folder + "/" + file);
    }
    bars.row("%s soft against the prototype's rule,< %.4f,%.4f,%s", name, default_prototype, soft,
             bar(soft < default_prototype));
    bars.row("%s soft against the prototype's best strength,< %.4f,%.4f,%s", name, best_prototype,
             soft, bar(soft < best_prototype));
  }
  return 0;
}
