// SPDX-License-Identifier: LGPL-2.1-or-later
// What a surface made from some real cameras shows from the place of another, against that one's
// picture, inside its silhouette: the hull and the refined surface, coloured in all ways. One row
// for each set, way and camera left out, and their means, in leftout.csv.
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "command_line.h"
#include "measure.h"
#include "mesh/texture_mesh.h"
#include "room_frames.h"
#include "support/real_sets.h"

namespace {

using namespace polyhull;
using namespace polyhull::test;
using benchmark::Table;

/// A way to colour surfaces.
struct Colouring {
  const char* method;
  const char* metric;
  TextureSettings settings;
};

/// The direct method takes the best camera by the surface's normal, whatever the metric.
std::vector<Colouring> colourings() {
  std::vector<Colouring> all;
  for (const bool occlusion : {false, true}) {
    TextureSettings settings;
    settings.occlusion = occlusion;
    settings.method = TextureMethod::direct;
    all.push_back({"direct", "-", settings});
    settings.method = TextureMethod::blend;
    settings.metric = TextureMetric::camera_normal;
    all.push_back({"blend", "camera-normal", settings});
    settings.metric = TextureMetric::viewing_angle;
    all.push_back({"blend", "viewing-angle", settings});
  }
  return all;
}

/// Some cameras of a set, and those that are left out.
struct Split {
  std::vector<std::size_t> used, left_out;
};

struct Options {
  std::vector<std::string> sets;
  std::string output = ".", pictures;
  bool fine = false;
};

/// What is measured of a drawn picture, or sums of it.
struct Figures {
  Likeness inside, either;
  double overlap = 0.0;

  void add(const Figures& more, double share) {
    inside.psnr += share * more.inside.psnr;
    inside.ssim += share * more.inside.ssim;
    either.psnr += share * more.either.psnr;
    either.ssim += share * more.either.ssim;
    overlap += share * more.overlap;
  }
};

Figures figures_of(const Picture& drawn, const Picture& seen) {
  return {likeness(drawn, seen, Within::silhouette), likeness(drawn, seen, Within::either),
          overlap(drawn, seen)};
}

/// A row of the means, as sums.
struct Row {
  std::string surface;
  Colouring colouring;
  Figures sum{};
  int count = 0;
};

void print(Table& table, const std::string& set, const std::string& camera, const Row& row,
           const Figures& figures) {
  table.row("%s,%s,%s,%s,%s,%s,%.2f,%.4f,%.2f,%.4f,%.4f", set.c_str(), camera.c_str(),
            row.surface.c_str(), row.colouring.method, row.colouring.metric,
            row.colouring.settings.occlusion ? "on" : "off", figures.inside.psnr,
            figures.inside.ssim, figures.either.psnr, figures.either.ssim, figures.overlap);
}

/// Pictures side by side.
void save_sheet(const std::vector<Picture>& pictures, const std::string& path) {
  Picture sheet{0, pictures.front().height, 4, {}};
  for (const Picture& picture : pictures) sheet.width += picture.width;
  sheet.pixels.resize(static_cast<std::size_t>(sheet.width) * sheet.height * 4);
  int left = 0;
  for (const Picture& picture : pictures) {
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < 4 * picture.width; ++x)
        sheet.row(y)[4 * left + x] = x % 4 == 3 ? 255 : picture.row(y)[x];
    left += picture.width;
  }
  save_picture(sheet, path);
}

void measure(const RealSet& set, const Split& split, const Options& options,
             std::vector<Row>& means, Table& table) {
  Mesh mesh = hull_mesh(set, split.used);
  const Hull surfaces[] = {mesh.hull, refined_hull(mesh, options.fine)};
  const char* const names[] = {"hull", "refined"};
  std::vector<std::vector<Picture>> sheets(split.left_out.size());
  std::size_t at = 0;
  for (int s = 0; s < 2; ++s)
    for (const Colouring& colouring : colourings()) {
      mesh.hull = surfaces[s];
      texture_mesh(mesh, colouring.settings);
      if (means.size() <= at) means.push_back({names[s], colouring});
      for (std::size_t i = 0; i < split.left_out.size(); ++i) {
        const RealView& view = set.views[split.left_out[i]];
        const Picture seen = seen_by(view), drawn = drawn_for(view, mesh);
        const Figures figures = figures_of(drawn, seen);
        means[at].sum.add(figures, 1.0);
        ++means[at].count;
        print(table, set.name, view.camera.name, means[at], figures);
        if (std::string(colouring.metric) == "viewing-angle" && colouring.settings.occlusion)
          sheets[i].push_back(drawn);
      }
      ++at;
    }
  if (options.pictures.empty()) return;
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    const RealView& view = set.views[split.left_out[i]];
    sheets[i].push_back(seen_by(view));
    save_sheet(sheets[i], options.pictures + "/" + set.name + "-" + view.camera.name + ".png");
  }
}

/// Each \p step-th camera is used, all others are left out.
Split every(const RealSet& set, std::size_t step) {
  Split split;
  for (std::size_t k = 0; k < set.views.size(); ++k)
    (k % step == 0 ? split.used : split.left_out).push_back(k);
  return split;
}

/// One camera is left out after the other.
std::vector<Split> each_left_out(const RealSet& set) {
  std::vector<Split> splits;
  for (std::size_t out = 0; out < set.views.size(); ++out) {
    splits.push_back({{}, {out}});
    for (std::size_t k = 0; k < set.views.size(); ++k)
      if (k != out) splits.back().used.push_back(k);
  }
  return splits;
}

bool wanted(const Options& options, const std::string& name) {
  return options.sets.empty() ||
         std::find(options.sets.begin(), options.sets.end(), name) != options.sets.end();
}

void finish(const std::string& set, const std::vector<Row>& means, Table& table) {
  if (means.empty()) std::printf("%s is not in POLYHULL_DATA: left out.\n", set.c_str());
  for (const Row& row : means) {
    Figures mean;
    mean.add(row.sum, 1.0 / row.count);
    print(table, set, "mean", row, mean);
  }
}

void run_all(const Options& options) {
  const char* variable = std::getenv("POLYHULL_DATA");
  const std::string data = variable ? variable : "";
  Table table(options.output + "/leftout.csv",
              "set,camera,surface,method,metric,occlusion,psnr_db,ssim,"
              "psnr_either_db,ssim_either,overlap");
  if (wanted(options, "oxford")) {
    std::vector<Row> means;
    if (const auto set = oxford_dinosaur(data))
      measure(*set, every(*set, 3), options, means, table);
    finish("oxford", means, table);
  }
  if (wanted(options, "middlebury")) {
    std::vector<Row> means;
    if (const auto set = middlebury_dinosaur(data))
      measure(*set, every(*set, 2), options, means, table);
    finish("middlebury", means, table);
  }
  if (wanted(options, "room")) {
    std::vector<Row> means;
    for (const RealSet& set : benchmark::room_sets(data, {40, 200, 400}))
      for (const Split& split : each_left_out(set)) measure(set, split, options, means, table);
    finish("room", means, table);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command(
      "leftout_benchmark",
      "Draws real subjects from the place of a camera that was left out; writes leftout.csv.");
  Options options;
  command.option("--set", &options.sets, "Only these: oxford, middlebury, room");
  command.flag("--fine", &options.fine, "The refined surface with quality fine instead of good");
  command
      .option("--pictures", &options.pictures,
              "Folder for pictures: hull, refined (blended by viewing angle), and what was seen")
      .existing_folder();
  command.option("--output", &options.output, "Folder for the table").existing_folder();
  return command.run(argc, argv, [&] {
    run_all(options);
    return 0;
  });
}
