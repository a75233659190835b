// SPDX-License-Identifier: LGPL-2.1-or-later
#include "calibrate/input.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>

#include "base/error.h"
#include "base/plain_text.h"
#include "base/thread_pool.h"
#include "wire/payload.h"

namespace polyhull::calibrate_tool {
namespace {

namespace fs = std::filesystem;
using calibration::BoardFinder;
using calibration::Take;
using calibration::View;
bool is_picture(const fs::path& path) {
  const std::string ending = lower_case(path.extension().string());
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg";
}

// The last run of digits in a name, without leading zeros; empty where it has none.
std::string number_in(const std::string& name) {
  const auto last = name.find_last_of("0123456789");
  if (last == std::string::npos) return "";
  const auto before = name.find_last_not_of("0123456789", last);
  const auto first = before == std::string::npos ? 0 : before + 1;
  const auto digit = std::min(name.find_first_not_of('0', first), last);
  return name.substr(digit, last - digit + 1);
}

// Numbers by value, names by letters.
struct InOrder {
  bool operator()(const std::string& a, const std::string& b) const {
    const bool numbers = a.find_first_not_of("0123456789") == std::string::npos &&
                         b.find_first_not_of("0123456789") == std::string::npos;
    if (numbers && a.size() != b.size()) return a.size() < b.size();
    return a < b;
  }
};

using Files = std::map<std::string, std::vector<fs::path>>;  // by camera

bool share_names(const Files& files) {
  std::map<std::string, int> cameras;
  for (const auto& [camera, paths] : files)
    for (const fs::path& path : paths)
      if (++cameras[path.stem().string()] > 1) return true;
  return files.size() < 2;
}

Files list_files(const std::string& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw Error(Error::Kind::not_found, "There is no folder '{}'.", folder);
  Files files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (!entry.is_directory()) continue;
    std::vector<fs::path> paths;
    for (const fs::directory_entry& file : fs::directory_iterator(entry.path()))
      if (is_picture(file.path())) paths.push_back(file.path());
    if (paths.empty())
      throw Error(Error::Kind::bad_input, "The folder '{}' holds no PNG or JPEG pictures.",
                  entry.path().string());
    std::ranges::sort(paths);
    const std::string name = entry.path().filename().string();
    if (!is_utf8(name))
      throw Error(Error::Kind::bad_input,
                  "The folder '{}' has a name that is not UTF-8, as the rig file needs for its "
                  "cameras; rename it.",
                  entry.path().string());
    files[name] = std::move(paths);
  }
  if (files.empty())
    throw Error(
        Error::Kind::bad_input,
        "The folder '{}' has no sub-folders; there must be one per camera, with its pictures.",
        folder);
  return files;
}

Picture load_grey(const std::string& path) {
  return load_picture(path, 1);
}

Picture mirrored(Picture picture) {
  for (int y = 0; y < picture.height; ++y)
    std::reverse(picture.row(y), picture.row(y) + picture.width);
  return picture;
}

// Why a camera's pictures may show no board.
[[noreturn]] void refuse_camera(const Pictures& pictures, std::size_t c, const BoardFinder& finder,
                                const calibration::Target& target) {
  int tried = 0;
  for (const std::string& file : pictures.files[c]) {
    if (file.empty() || !target.board.named || tried++ == 10) continue;
    if (finder.find(mirrored(load_grey(file))))
      throw Error(
          Error::Kind::bad_input,
          "The pictures of camera '{}' are mirrored: markers are read in '{}' only when it is "
          "reflected. Switch off mirroring in the camera or recorder.",
          pictures.cameras[c], file);
  }
  throw Error(
      Error::Kind::bad_input,
      "The board is in none of the pictures of camera '{}'. Has it {}x{} inner corners{}? A "
      "chessboard must be seen whole, sharp, with a white margin.",
      pictures.cameras[c], target.board.columns, target.board.rows,
      target.board.named ? " and markers of " + target.dictionary : "");
}

// One picture.
struct Job {
  std::size_t camera, instant;
  int width = 0, height = 0;
  std::optional<View> view;
};

std::vector<Job> look_for_boards(const Pictures& pictures, const BoardFinder& finder,
                                 const std::string& floor, const calibration::Progress& progress) {
  std::vector<Job> jobs;
  for (std::size_t c = 0; c < pictures.cameras.size(); ++c)
    for (std::size_t i = 0; i < pictures.instants.size(); ++i)
      if (!pictures.files[c][i].empty()) jobs.push_back({c, i});
  std::mutex telling;
  std::size_t done = 0;
  parallel_each(jobs.size(), 1, 0, [&](std::size_t j) {
    const std::string& file = pictures.files[jobs[j].camera][jobs[j].instant];
    const Picture grey = load_grey(file);
    jobs[j].width = grey.width;
    jobs[j].height = grey.height;
    try {
      jobs[j].view = finder.find(grey, pictures.instants[jobs[j].instant] == floor);
    } catch (const Error& error) {
      throw Error(error.kind(), "'{}': {}", file, error.what());
    }
    const std::lock_guard lock(telling);
    progress(fmt::format("finding the board in {} pictures", jobs.size()),
             static_cast<double>(++done) / static_cast<double>(jobs.size()));
  });
  return jobs;
}

}  // namespace

Pictures list_pictures(const std::string& folder) {
  const Files files = list_files(folder);
  const bool by_name = share_names(files);
  std::set<std::string, InOrder> instants;
  std::map<std::string, std::map<std::string, std::string>> found;  // camera, instant, path
  for (const auto& [camera, paths] : files) {
    for (const fs::path& path : paths) {
      const std::string instant = by_name ? path.stem().string() : number_in(path.stem().string());
      if (instant.empty())
        throw Error(Error::Kind::bad_input,
                    "No two cameras have pictures of the same name, and '{}' has no number in its "
                    "name: pictures of one instant must share name or number.",
                    path.string());
      if (!found[camera].emplace(instant, path.string()).second)
        throw Error(Error::Kind::bad_input,
                    "Camera '{}' has two pictures of instant '{}': '{}' and '{}'.", camera, instant,
                    found[camera][instant], path.string());
      instants.insert(instant);
    }
  }
  Pictures out;
  out.instants.assign(instants.begin(), instants.end());
  for (const auto& [camera, by_instant] : found) {
    out.cameras.push_back(camera);
    auto& row = out.files.emplace_back();
    for (const std::string& instant : out.instants) {
      const auto at = by_instant.find(instant);
      row.push_back(at == by_instant.end() ? "" : at->second);
    }
  }
  return out;
}

void take_size(int width, int height, const std::string& file, calibration::TakeCamera& camera) {
  if (camera.width == 0) {
    camera.width = width;
    camera.height = height;
  }
  if (width != camera.width || height != camera.height)
    throw Error(Error::Kind::bad_input,
                "'{}' has {}x{} pixels, the pictures before it of camera '{}' {}x{}.", file, width,
                height, camera.name, camera.width, camera.height);
}

Take find_views(const Pictures& pictures, const calibration::Target& target,
                const std::string& floor, const calibration::Progress& progress) {
  const BoardFinder finder(target);
  std::vector<Job> jobs = look_for_boards(pictures, finder, floor, progress);
  Take take;
  take.board = target.board;
  take.instants = pictures.instants;
  for (const std::string& name : pictures.cameras) take.cameras.push_back({name, 0, 0, {}});
  std::vector<bool> seen(pictures.cameras.size(), false);
  for (Job& job : jobs) {
    calibration::TakeCamera& camera = take.cameras[job.camera];
    take_size(job.width, job.height, pictures.files[job.camera][job.instant], camera);
    if (!job.view) continue;
    job.view->camera = job.camera;
    job.view->instant = job.instant;
    take.views.push_back(std::move(*job.view));
    seen[job.camera] = true;
  }
  for (std::size_t c = 0; c < seen.size(); ++c)
    if (!seen[c]) refuse_camera(pictures, c, finder, target);
  return take;
}

void use_lenses(Take& take, const Rig& rig) {
  for (calibration::TakeCamera& camera : take.cameras) {
    const Camera* known = rig.find(camera.name);
    if (!known)
      throw Error(Error::Kind::bad_input, "The file with the lenses has no camera '{}'.",
                  camera.name);
    if (known->width != camera.width || known->height != camera.height)
      throw Error(
          Error::Kind::bad_input,
          "The pictures of camera '{}' have {}x{} pixels, its lens was calibrated with {}x{}.",
          camera.name, camera.width, camera.height, known->width, known->height);
    camera.known = *known;
  }
}

}  // namespace polyhull::calibrate_tool
