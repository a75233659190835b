// SPDX-License-Identifier: LGPL-2.1-or-later
// Calibrations as other systems, spreadsheets and people save them.
#include "base/plain_text.h"
#include "lib/rig/import_support.h"
#include "rig/export.h"

namespace polyhull {
namespace {

using namespace std::string_literals;

// The ASCII \p text in UTF-16.
std::string utf16(const std::string& text, bool big_endian) {
  std::string out;
  for (const char c : text) out += big_endian ? std::string{'\0', c} : std::string{c, '\0'};
  return out;
}

// \p text as programs of other systems save it.
std::vector<std::string> saved_elsewhere(const std::string& text) {
  const std::string windows = with(text, "\n", "\r\n");
  return {windows,
          "\xEF\xBB\xBF" + windows,
          with(text, "\n", "\r\r\n"),
          with(text, "\n", "\r"),
          "\xFF\xFE" + utf16(windows, false),
          "\xFE\xFF" + utf16(text, true),
          utf16(windows, false)};
}

std::string row_of(const Mat3& m) {
  std::string text;
  for (const double value : to_rows(m)) text += fmt::format(" {:.17e}", value);
  return text;
}

// The twelve numbers of K [R | t], with \p axes between K and [R | t].
std::array<double, 12> projection(const Camera& camera, const Vec3& axes = Vec3(1.0)) {
  const Mat3 K = camera.K * from_rows({axes.x, 0, 0, 0, axes.y, 0, 0, 0, axes.z});
  const auto m = to_rows(K * camera.R);
  const Vec3 t = K * camera.t;
  return {m[0], m[1], m[2], t.x, m[3], m[4], m[5], t.y, m[6], m[7], m[8], t.z};
}

// A line for each camera, its numbers written as \p number and separated by \p separator.
std::string matrices(const Rig& rig, const char* number = "{:.12e}",
                     const std::string& separator = " ", const Vec3& axes = Vec3(1.0)) {
  std::string text;
  for (const Camera& camera : rig.cameras) {
    std::string line;
    for (const double value : projection(camera, axes))
      line += (line.empty() ? "" : separator) + fmt::format(fmt::runtime(number), value);
    text += line + "\n";
  }
  return text;
}

import::Options sized(){import::Options options;
options.width = 1024;
options.height = 768;
return options;
}  // namespace

// The rig that pmatrices makes of \p text.
Rig from_matrices(const std::string& text) {
  const std::string file = empty_folder() + "/P.txt";
  write_text(text, file);
  return import::projection_matrices({file}, sized());
}

TEST(RigImportKinds, TextsOfOtherSystems) {
  for (const std::string& bytes : saved_elsewhere("a\n\nb c\n"))
    EXPECT_EQ(plain_text(bytes, "x"), "a\n\nb c\n");
  EXPECT_EQ(plain_text("\xFF\xFE\xE4\0\xAC\x20\x3D\xD8\0\xDE"s, "x"), "ä€😀");
  EXPECT_EQ(plain_text("", "x"), "");
  EXPECT_EQ(plain_text("\r", "x"), "\n");
  EXPECT_EQ(plain_text(std::string(1 << 20, '\r') + "a\r\r\nb", "x"),
            std::string(1 << 20, '\n') + "a\nb");
  for (const std::string& broken :
       {"\xFF\xFE\x41"s, "\xFF\xFE\x3D\xD8"s, "\xFF\xFE\x3D\xD8\x41\0"s, "\xFF\xFE\0\xDE"s})
    expect_refused([&] { plain_text(broken, "x.txt"); }, "x.txt: its text is UTF-16 and broken");
  expect_refused([] { plain_text("\xFF\xFE\0\0a\0\0\0"s, "x.txt"); }, "x.txt: its text is UTF-32");
}

TEST(RigImportKinds, EveryFormatAsOtherSystemsSaveIt) {
  const Rig truth = with_lenses();
  const std::string folder = empty_folder();
  exported::colmap(truth, folder);
  exported::opencv(truth, folder);
  std::string table, middlebury = "4\n", matlab;
  for (const Camera& camera : truth.cameras) {
    const std::string pose =
        row_of(camera.R) + fmt::format(" {} {} {}", camera.t.x, camera.t.y, camera.t.z);
    table += camera.name + row_of(camera.K) + " -0.1 0.02 0.001 0.002 0" + pose + "\n";
    middlebury += camera.name + ".png" + row_of(camera.K) + pose + "\n";
  }
  const Camera& first = truth.cameras[0];
  const Vec3 om = rodrigues(first.R);
  matlab = fmt::format(
      "% A camera\nfc = [ 700 ; 700 ];\ncc = [ 511.5 ; 383.5 ]\nnx = 1024\nny = 768;\n"
      "omc_1 = [ {} ; {} ; ...\n {} ];\nTc_1 = [ {} ; {} ; {} ];\n",
      om.x, om.y, om.z, first.t.x, first.t.y, first.t.z);
  Rig one = truth;
  one.cameras.resize(1);
  const auto in_all_ways = [&](const std::string& name, const std::string& text, const Rig& wanted,
                               const std::function<Rig(const std::string&)>& read) {
    SCOPED_TRACE(name);
    const std::string path = folder + "/" + name;
    for (const std::string& bytes : saved_elsewhere(text)) {
      write_text(bytes, path);
      expect_same(read(path), wanted);
    }
    write_text(text, path);
  };
  for (const char* name : {"cameras.txt", "images.txt"})
    in_all_ways(name, read_text(folder + "/" + name), truth,
                [&](const std::string&) { return import::colmap(folder, {}); });
  in_all_ways("cam0.yml", read_text(folder + "/cam0.yml"), one,
              [](const std::string& path) { return import::opencv({path}, {}); });
  in_all_ways("chain.yaml", exported::kalibr(truth), truth,
              [](const std::string& path) { return import::kalibr(path, {}); });
  in_all_ways("rig.json", rig_to_json(truth), truth, load_rig);
  in_all_ways("P.txt", matrices(truth), truth,
              [](const std::string& path) { return import::projection_matrices({path}, sized()); });
  in_all_ways("table.txt", table, truth,
              [](const std::string& path) { return import::text(path, sized()); });
  in_all_ways("x_par.txt", middlebury, truth,
              [](const std::string& path) { return import::middlebury(path, sized()); });
  in_all_ways("cam0.m", matlab, one,
              [](const std::string& path) { return import::bouguet({path}, {}); });
}

TEST(RigImportKinds, MatricesOfSpreadsheetsAndPrograms) {
  const Rig truth = default_rig();
  const std::string plain = matrices(truth);
  const std::string decimal = with(plain, ".", ",");
  std::string fortran = with(with(plain, "e+", "D+"), "e-", "d-");
  std::string matlab, rows, numpy, four, square;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = projection(truth.cameras[i]);
    const auto row = [&](int r, const char* separator) {
      return fmt::format("{1:.12e}{0}{2:.12e}{0}{3:.12e}{0}{4:.12e}", separator, p[4 * r],
                         p[4 * r + 1], p[4 * r + 2], p[4 * r + 3]);
    };
    matlab += fmt::format("% camera {}\nP{} = [ {} ; {} ; {} ];\n", i, i, row(0, " "), row(1, ", "),
                          row(2, " "));
    rows += fmt::format("P(:,:,{}) =\n\n   {} ...\n   {};\n   {}\n", i + 1, row(0, "  "),
                        row(1, ","), row(2, " "));
    numpy += fmt::format("P{} = np.array([[{}],\n  [{}],\n  [{}]])\n", i, row(0, ", "),
                         row(1, ", "), row(2, ", "));
    square += fmt::format("{} {} {} 0 0 0 1\n", row(0, " "), row(1, " "), row(2, " "));
    four += fmt::format("Camera {}\n{}\n{}\n{}\n0.0 0.0 0.0 1.0\n\n", i, row(0, "\t"), row(1, "\t"),
                        row(2, "\t"));
  }
  for (const std::string& text :
       {plain, fortran, decimal, with(decimal, " ", ";"), with(decimal, " ", "\t"), matlab, rows,
        numpy, four, square, with(square, " ", ";"), matrices(truth, "{:.12e}", ","),
        matrices(truth, "{:.12e}", ", "), matrices(truth, "{:.12e}", "; "),
        "P11,P12,P13\n" + matrices(truth, "\"{:.12e}\"", ","),
        matrices(truth, "{:.12e}", ",") + "# the end, 1 2 3\n"}) {
    SCOPED_TRACE(text);
    expect_same(from_matrices(text), truth, 1e-8);
  }
  const auto refuses = [](const std::string& text, const std::string& part) {
    expect_refused([&] { from_matrices(text); }, part);
  };
  refuses(matrices(truth, "x{:.3f}"), "P.txt: no line of it holds the 12 numbers");
  refuses("cam0 1 " + plain, "P.txt, line 1: 'cam0' is not a number");
  refuses("1 0 0 0\nhalf\n0 1 0 0\n0 0 1 0\n", "P.txt, line 2: a projection matrix is cut short");
  refuses("1 0 0 1,5\n", "P.txt: the last projection matrix is not complete");
  refuses(with(square, " 0 0 0 1", " 0 0 1 1"), "found 16");
  refuses("1 0 0 1e999\n", "P.txt, line 1: '1e999' is not finite");
  // What has the wrong handedness, and why.
  refuses(matrices(truth, "{:.12e}", " ", Vec3(1, -1, -1)),
          "line 1: P has the scene behind the camera, as OpenGL's");
  Rig mirrored = truth;
  for (Camera& camera : mirrored.cameras)
    for (int column = 0; column < 3; ++column) camera.R[2][column] = -camera.R[2][column];
  refuses(matrices(mirrored), "left-handed frame");
}

TEST(RigImportKinds, MatricesAsProgramsPrintThem) {
  Rig truth = default_rig();
  std::string blender, python, json = "{\"P\": [", indented = "[", named, quoted, scaled, page;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = projection(truth.cameras[i]);
    const auto row = [&](int r, const char* separator) {
      return fmt::format("{1:.12e}{0}{2:.12e}{0}{3:.12e}{0}{4:.12e}", separator, p[4 * r],
                         p[4 * r + 1], p[4 * r + 2], p[4 * r + 3]);
    };
    const std::string rows[] = {row(0, ", "), row(1, ", "), row(2, ", ")};
    blender += fmt::format("<Matrix 3x4 ({})\n            ({})\n            ({})>\n", rows[0],
                           rows[1], rows[2]);
    python += fmt::format("P{} = (({}), ({}), ({}))\n", i, rows[0], rows[1], rows[2]);
    const char* comma = i == 0 ? "" : ", ";
    json += fmt::format("{}[[{}], [{}], [{}]]", comma, rows[0], rows[1], rows[2]);
    indented +=
        fmt::format("{}\n [\n  [{}],\n  [{}],\n  [{}]\n ]", comma, with(rows[0], ", ", ",\n   "),
                    with(rows[1], ", ", ",\n   "), with(rows[2], ", ", ",\n   "));
    named += fmt::format("camera {},{},{},{}\n", i, row(0, ","), row(1, ","), row(2, ","));
    const std::string cells =
        row(0, "\",\"") + "\",\"" + row(1, "\",\"") + "\",\"" + row(2, "\",\"");
    quoted += "\"" + with(cells, ".", ",") + "\"\n";
    scaled += fmt::format("{}\n{}\n{}\n0 0 0 2.5\n", row(0, " "), row(1, " "), row(2, " "));
    page += fmt::format("| {} |\n| {} |\n| {} |\n", row(0, " | "), row(1, "\xC2\xA0"),
                        with(row(2, " "), "-", "\xE2\x88\x92"));
  }
  for (const std::string& text :
       {blender, python, json + "], \"width\": 1024}", indented + "\n]\n", quoted, scaled, page}) {
    SCOPED_TRACE(text);
    expect_same(from_matrices(text), truth, 1e-8);
  }
  named = with(named, "camera ", "view");
  for (Camera& camera : truth.cameras) camera.name = with(camera.name, "cam", "view");
  expect_same(from_matrices(named), truth, 1e-8);
  expect_refused([] { from_matrices("P =\n\n   1.0e+03 *\n\n    0.7    0    0.3    1.2\n"); },
                 "P.txt, line 3: Matlab shows a matrix here");
  // A pose is no camera: KITTI's calibration to the lidar, or extrinsics alone, also as 4x4.
  for (const char* pose :
       {"Tr: 0 -1 0 .1 0 0 -1 .2 1 0 0 3\n", "0 -2 0 1\n0 0 -2 1\n2 0 0 5\n0 0 0 1\n"})
    expect_refused([&] { from_matrices(pose); },
                   "P.txt, line 1: P is a pose [R | t] without a lens");
  // Pixels counted in widths and heights.
  expect_refused([] { from_matrices(".9 0 .5 0 0 1.2 .5 0 0 0 1 3\n"); },
                 "the focal length of 'cam0' is 0.9 px");
  expect_same(from_matrices(with(named, "view", "cam")), default_rig(), 1e-8);
  std::string kitti = with(named, ",", " ");
  for (const char* number : {"0", "1", "2", "3"})
    kitti = with(kitti, fmt::format("view{} ", number), fmt::format("view{}: ", number));
  expect_same(from_matrices(kitti), truth, 1e-8);
  expect_same(from_matrices(kitti + "Tr: 0 -1 0 .1 0 0 -1 .2 1 0 0 3\n"), truth, 1e-8);
  expect_refused([] { from_matrices("[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"); }, "found 3");
}

TEST(RigImportKinds, TablesWithNamesOfWords) {
  const std::string file = empty_folder() + "/table.txt";
  const std::string numbers = " 700 0 511.5 0 700 383.5 0 0 1 0 0 0 0 0 1 0 0 0 1 0 0 0 1 0 0 3\n";
  const auto read = [&](const std::string& text) {
    write_text(text, file);
    return import::text(file, sized()).cameras;
  };
  EXPECT_EQ(read("Stage Cam 1" + numbers + "  # none\n").at(0).name, "Stage Cam 1");
  EXPECT_EQ(read(with("cam#1" + numbers, " ", ",")).at(0).name, "cam#1");
  EXPECT_EQ(read("\"a b\"" + with(numbers, " ", ";")).at(0).name, "a b");
  EXPECT_EQ(read("a" + with(with(numbers, "511.5", "511,5"), "383.5", "383,5")).at(0).K[2][0],
            511.5);
  std::string heading = "name";
  for (int i = 0; i < 26; ++i) heading += fmt::format(",n{}", i);
  EXPECT_EQ(read(heading + "\ncam" + numbers).at(0).name, "cam");
  write_text(std::string("MATLAB 5.0 MAT-file\0\0", 21), file);
  expect_refused([&] { import::text(file, sized()); }, "is no text but a binary file");
  expect_refused([&] { read("0 1" + numbers); },
                 "table.txt, line 1: expected a name and 26 numbers");
  expect_refused([&] { read("cam" + with(numbers, "511.5", "5x")); },
                 "line 1: '5x' is not a number");
  expect_refused([&] { read("cam 1 2 3\n"); }, "line 1: expected 26 numbers, found 3");
  const std::string pictures = " 700 0 511.5 0 700 383.5 0 0 1 1 0 0 0 1 0 0 0 1 0 0 3\n";
  write_text("2\ncam a/000.png" + pictures + "cam b/000.png" + with(pictures, " 3\n", " 4\n"),
             file);
  EXPECT_EQ(import::middlebury(file, sized()).cameras.at(1).name, "cam b");
}

}  // namespace polyhull
}  // namespace polyhull
