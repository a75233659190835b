// SPDX-License-Identifier: LGPL-2.1-or-later
// What to show while cameras are missing: the figure walks and waves, cameras fall out for some
// frames, a second or for good, and what each policy shows is held against the true figure.
// missing_camera.csv holds, per loss, policy and length of the outage, in per cent of the figure's
// area: what is wrong in the picture, what of it is figure cut off and what is added, how much more
// is wrong than with all cameras, on average and in the outage's last frame, the worst instant, and
// the largest jumps from one picture to the next beyond the figure's own motion, while cameras are
// missing and when they come back. For good means three seconds.
#include <algorithm>
#include <cstdio>
#include <map>
#include <tuple>

#include "base/thread_pool.h"
#include "command_line.h"
#include "lost_cameras.h"
#include "measure.h"
#include "outage.h"

namespace polyhull::benchmark {
namespace {

/// Outages begin in the walk and, the last two, in the wave.
constexpr double starts[] = {0.9, 1.6, 2.3, 3.0, 3.7, 4.4, 7.6, 8.3};
constexpr int lengths[] = {1, 2, 3, 5, 10, 25, Outage::longest};  // frames

/// \p during is shown until \p time after the last view, then \p after; frozen: the last picture.
struct Policy {
  std::string name;
  Source during;
  double time;
  Source after;

  const Pictures& shown(const Outage& outage, std::size_t i) const {
    const std::size_t frames = static_cast<std::size_t>(time / frame_time + 1e-6);
    if (i <= frames) return outage.shown(i == 0 ? whole : during, i);
    return after == frozen ? outage.shown(during, frames) : outage.shown(after, i);
  }
};

std::vector<Policy> all_policies() {
  std::vector<Policy> all = {{"all cameras", whole, 0, whole},
                             {"drop-camera", without, 0, without},
                             {"drop-set", whole, 0, frozen}};
  const auto add = [&](const char* name, Source during, double time, Source after) {
    char text[80];
    std::snprintf(text, sizeof text, name, time);
    all.push_back({text, during, time, after});
  };
  for (const double time : {0.04, 0.1, 0.2, 0.5, 1.0}) {
    add("hold %g s", held, time, without);
    add("freeze %g s", frozen, time, without);
  }
  return all;
}

/// Sets of cameras that fall out, each at every \p every-th start.
struct Loss {
  const char* name;
  std::vector<std::vector<int>> sets;
  std::size_t every;
};

/// What is added up over outages.
struct Sums {
  double error = 0, cut_off = 0, excess = 0, last = 0, jump_in = 0, jump_out = 0, worst = 0;
  int cases = 0;
  void add(const Sums& other) {
    error += other.error;
    cut_off += other.cut_off;
    excess += other.excess;
    last += other.last;
    jump_in += other.jump_in;
    jump_out += other.jump_out;
    worst = std::max(worst, other.worst);
    cases += other.cases;
  }
};

Sums score(const Outage& outage, const Policy& policy, int length) {
  Sums sums;
  sums.cases = 1;
  const std::vector<Instant>& instants = outage.instants();
  for (std::size_t i = 1; i < instants.size() && instants[i].frame < length; ++i) {
    const Pictures& shown = policy.shown(outage, i);
    const double part = double(instants[i].weight) / length, error = outage.error(shown, i);
    sums.last = error - outage.error(outage.shown(whole, i), i);
    sums.error += part * error;
    sums.cut_off += part * outage.cut_off(shown, i);
    sums.excess += part * sums.last;
    sums.worst = std::max(sums.worst, error);
    if (instants[i].frame <= Outage::dense)
      sums.jump_in = std::max(sums.jump_in, outage.jump(policy.shown(outage, i - 1), shown, i));
  }
  if (length <= Outage::dense) {
    const auto back = static_cast<std::size_t>(length) + 1;
    sums.jump_out =
        std::max(0.0, outage.jump(policy.shown(outage, back - 1), outage.shown(whole, back), back));
  }
  return sums;
}

void study(Table& table, const NamedRig& rig, bool refined, const std::vector<Loss>& losses,
           const std::string& sheets) {
  const std::vector<Policy> policies = all_policies();
  using Scores = std::map<std::tuple<const Loss*, const Policy*, int>, Sums>;
  std::vector<Scores> scores(std::size(starts));
  const auto work = [&](std::size_t s) {
    if (std::none_of(losses.begin(), losses.end(), [&](auto& loss) { return s % loss.every == 0; }))
      return;
    Outage outage(rig.rig, starts[s], refined);
    for (const Loss& loss : losses) {
      if (s % loss.every != 0) continue;
      for (const std::vector<int>& missing : loss.sets) {
        outage.lose(missing);
        for (const Policy& policy : policies)
          for (const int length : lengths)
            scores[s][{&loss, &policy, length}].add(score(outage, policy, length));
        if (!sheets.empty() && &missing == &loss.sets.front())
          save_picture(outage.sheet(), sheets + "/" + loss.name + " of " + rig.name +
                                           (refined ? ", refined, " : ", hull, ") +
                                           std::to_string(s) + ".png");
      }
    }
  };
  parallel_for(std::size(starts), 1, 0, [&](std::size_t first, std::size_t last) {
    for (std::size_t s = first; s < last; ++s) work(s);
  });
  for (const Loss& loss : losses) {
    for (const Policy& policy : policies) {
      for (const int length : lengths) {
        Sums sum;
        for (Scores& some : scores) sum.add(some[{&loss, &policy, length}]);
        const double part = 100.0 / sum.cases;
        table.row("%s,%s,%s,%s,%d,%.1f,%.1f,%.1f,%.1f,%.1f,%.1f,%.1f,%.1f", rig.name.c_str(),
                  refined ? "refined" : "hull", loss.name, policy.name.c_str(), length,
                  part * sum.error, part * sum.cut_off, part * (sum.error - sum.cut_off),
                  part * sum.excess, part * sum.last, 100.0 * sum.worst, part * sum.jump_in,
                  part * sum.jump_out);
      }
    }
  }
}

}  // namespace
}  // namespace polyhull::benchmark

int main(int argc, char** argv) {
  using namespace polyhull::benchmark;
  polyhull::CommandLine command(
      "missing_camera",
      "Compares what to show while cameras are missing: missing_camera.csv. What cameras leave of "
      "a "
      "body when they are lost, and what colours: lost_cameras.csv, lost_colours.csv.");
  std::string output = ".", sheets;
  std::vector<std::string> names{"four", "five", "eight"};
  std::vector<std::string> tables{"missing_camera", "lost_cameras", "lost_colours"};
  command.option("folder", &output, "Folder for the tables").existing_folder();
  command.option("--sheets", &sheets, "Folder for pictures").existing_folder();
  command.option("--rig", &names, "Only these of the rigs four, five and eight");
  command.option("--table", &tables, "Only these of the tables");
  return command.run(argc, argv, [&] {
    const auto has = [](const std::vector<std::string>& list, const std::string& name) {
      return std::find(list.begin(), list.end(), name) != list.end();
    };
    std::vector<NamedRig> rigs = shipped_rigs();
    std::erase_if(rigs, [&](const NamedRig& rig) { return !has(names, rig.name); });
    if (has(tables, "lost_cameras")) {
      Table table(output + "/lost_cameras.csv",
                  "rig,lost,cameras,body,volume,hull_volume,hull_mm,hull_hausdorff_mm,hull_overlap,"
                  "surface_volume,surface_mm,surface_hausdorff_mm,surface_overlap");
      for (const NamedRig& rig : rigs) study_losses(table, rig, sheets);
    }
    if (has(tables, "lost_colours")) {
      Table table(output + "/lost_colours.csv", "rig,seconds,shown,camera_or_frames,psnr");
      for (const NamedRig& rig : rigs) study_colours(table, rig);
    }
    if (!has(tables, "missing_camera")) return 0;
    Table table(output + "/missing_camera.csv",
                "rig,surface,missing,policy,frames,error,cut_off,added,excess,last_excess,worst,"
                "jump_in,jump_out");
    for (const NamedRig& rig : rigs)
      for (const bool refined : {false, true})
        study(table, rig, refined, {{"1", {{0}, {1}, {2}, {3}}, 3}}, sheets);
    return 0;
  });
}
