// SPDX-License-Identifier: LGPL-2.1-or-later
// Reads meshes as hullbuild and hulltexture send them (application/x-polyhull-mesh, one per file,
// as multifilesink writes them) and tells what they are worth: coverage tables and contact sheets.
#include <cstdio>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/picture.h"
#include "base/whole_file.h"
#include "command_line.h"
#include "hull/measure.h"
#include "report/coverage.h"
#include "report/sheet.h"
#include "wire/mesh_payload.h"

namespace {

using namespace polyhull;

// A mesh with the bytes that its pixels lie in.
struct MeshFile {
  std::vector<std::uint8_t> bytes;
  Mesh mesh;
};

MeshFile read_mesh_file(const std::string& path) {
  const std::optional<std::string> bytes = whole_file(path);
  if (!bytes)
    throw Error(Error::Kind::not_found,
                "Mesh file '{}' cannot be opened; give a file of application/x-polyhull-mesh bytes "
                "that exists and may be read.",
                path);
  MeshFile result;
  result.bytes.assign(bytes->begin(), bytes->end());
  result.mesh = read_mesh(result.bytes);
  return result;
}

// In the rig's world coordinates and unit.
void print_extent(const Hull& hull) {
  if (hull.empty()) return;
  Vec3f low = hull.vertices.front(), high = low;
  for (const Vec3f& vertex : hull.vertices) {
    low = glm::min(low, vertex);
    high = glm::max(high, vertex);
  }
  const Vec3 from = hull.origin + Vec3(low), to = hull.origin + Vec3(high);
  std::printf("from (%.4g, %.4g, %.4g) to (%.4g, %.4g, %.4g)\n", from.x, from.y, from.z, to.x, to.y,
              to.z);
}

void print_coverage(const std::vector<report::Coverage>& rows) {
  std::printf("%-20s %10s %10s %10s\n", "view", "mask px", "covered", "outside");
  double least = 1.0, most = 0.0;
  for (const report::Coverage& row : rows) {
    std::printf("%-20s %10zu %9.3f%% %9.3f%%\n", row.camera.c_str(), row.mask,
                100.0 * row.covered_share(), 100.0 * row.outside_share());
    least = std::min(least, row.covered_share());
    most = std::max(most, row.outside_share());
  }
  std::printf("%-20s %10s %9.3f%% %9.3f%%\n", "worst", "", 100.0 * least, 100.0 * most);
}

int coverage(const std::vector<std::string>& paths, report::Mask mask,
             const std::string& json_path) {
  nlohmann::json json = nlohmann::json::array();
  for (const std::string& path : paths) {
    const MeshFile file = read_mesh_file(path);
    const auto rows = report::measure_coverage(file.mesh, mask);
    std::printf("%s: %zu vertices, %zu triangles\n", path.c_str(), file.mesh.hull.vertices.size(),
                file.mesh.hull.triangles.size() / 3);
    print_extent(file.mesh.hull);
    print_coverage(rows);
    for (const report::Coverage& row : rows) {
      json.push_back({{"file", path},
                      {"camera", row.camera},
                      {"mask", row.mask},
                      {"covered", row.covered},
                      {"outside", row.outside}});
    }
  }
  if (!json_path.empty()) std::ofstream(json_path) << json.dump(2) << "\n";
  return 0;
}

// Names each mesh that is not closed; exit status 1 if there is one.
int closed(const std::vector<std::string>& paths) {
  std::size_t open = 0, empty = 0;
  for (const std::string& path : paths) {
    const MeshFile file = read_mesh_file(path);
    if (file.mesh.hull.empty()) ++empty;
    if (is_closed(file.mesh.hull)) continue;
    ++open;
    std::printf("%s: not closed\n", path.c_str());
  }
  std::printf("%zu of %zu meshes closed, %zu empty\n", paths.size() - open, paths.size(), empty);
  return open == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("polyhull-report", "Coverage tables and contact sheets of meshes in files");
  std::vector<std::string> meshes, composites;
  std::string output = "sheet.png", json_path;
  report::SheetSettings settings;
  bool by_matte = false;
  CommandLine table =
      command.subcommand("coverage", "How each camera's mask is filled by the hull");
  table.option("mesh", &meshes, "Mesh files").required();
  table.flag("--matte", &by_matte, "Against the keyed matte instead of the contours");
  table.option("--json", &json_path, "Also write the table to this file");
  CommandLine sheet = command.subcommand("sheet", "Draw what each stage made of one instant");
  sheet.option("mesh", &meshes, "Mesh file").required().expected(1);
  sheet.option("-o,--output", &output, "Picture to write").shown();
  sheet.option("--composite", &composites, "Pictures to show in the last rows");
  sheet.option("--columns", &settings.columns, "Cameras to show").shown();
  CommandLine check = command.subcommand("closed", "Whether every edge has its partner");
  check.option("mesh", &meshes, "Mesh files").required();
  return command.run(argc, argv, [&] {
    if (check.given()) return closed(meshes);
    if (table.given())
      return coverage(meshes, by_matte ? report::Mask::matte : report::Mask::contours, json_path);
    for (const std::string& path : composites) settings.composites.push_back(load_picture(path));
    const MeshFile file = read_mesh_file(meshes.front());
    save_picture(report::draw_sheet(file.mesh, settings), output);
    std::printf("%s\n", output.c_str());
    return 0;
  });
}
