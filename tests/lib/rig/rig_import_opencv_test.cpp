// SPDX-License-Identifier: LGPL-2.1-or-later
// OpenCV's calibrations as Python, EasyMocap and people write them.
#include <functional>

#include "lib/rig/import_support.h"

namespace polyhull {
namespace {

// How a file writes a matrix under a name.
using Matrix = std::function<std::string(const std::string& name, int columns,
                                         const std::vector<double>& values)>;

std::string listed(const std::vector<double>& values, std::size_t from, std::size_t count,
                   const char* separator = ", ") {
  std::string text;
  for (std::size_t i = from; i < from + count; ++i)
    text += (i == from ? "" : separator) + fmt::format("{}", values[i]);
  return text;
}

std::string storage(const std::string& name, int columns, const std::vector<double>& values) {
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n",
                     name, values.size() / columns, columns,
                     listed(values, 0, values.size(), ",\n       "));
}

std::string nested(const std::string& name, int columns, const std::vector<double>& values) {
  std::string text;
  for (std::size_t i = 0; i < values.size(); i += columns)
    text += (i == 0 ? "[" : ", [") + listed(values, i, columns) + "]";
  return name + ": [" + text + "]\n";
}

// As PyYAML writes arrays: a list not further in than its name.
std::string block(const std::string& name, int columns, const std::vector<double>& values) {
  std::string text = name + ":\n";
  for (std::size_t i = 0; i < values.size(); i += columns)
    text += "- - " + listed(values, i, columns, "\n  - ") + "\n";
  return text;
}

std::string flat(const std::string& name, int, const std::vector<double>& values) {
  return name + ": [" + listed(values, 0, values.size()) + "]\n";
}

std::string json(const std::string& name, int columns, const std::vector<double>& values) {
  const std::string text = nested(name, columns, values);
  return "\"" + name + "\"" + text.substr(name.size(), text.size() - name.size() - 1) + ",\n";
}

std::vector<double> numbers(const Mat3& m) {
  const auto rows = to_rows(m);
  return {rows.begin(), rows.end()};
}
std::vector<double> numbers(const Vec3& v) {
  return {v.x, v.y, v.z};
}

Rig one_camera() {
  Rig rig = with_lenses();
  rig.cameras.resize(1);
  return rig;
}

// The matrices of the camera of one_camera(), under the names of Python's tutorials.
std::string matrices(const Matrix& matrix) {
  const Camera camera = one_camera().cameras[0];
  return matrix("mtx", 3, numbers(camera.K)) + matrix("dist", 4, camera.distortion) +
         matrix("rotation_matrix", 3, numbers(camera.R)) + matrix("tvec", 1, numbers(camera.t));
}

Rig read(const std::string& text, const import::Options& options = {}) {
  const std::string path = empty_folder() + "/cam0.yml";
  write_text(text, path);
  return import::opencv({path}, options);
}

void expect_taken(const std::string& text) {
  SCOPED_TRACE(text);
  const Rig truth = one_camera(), rig = read(text);
  expect_same(rig, truth);
  EXPECT_EQ(rig.cameras[0].height, 768);
  EXPECT_EQ(rig.cameras[0].distortion, truth.cameras[0].distortion);
}

TEST(RigImportOpenCv, ListsOfNumbers) {
  const std::string head = "%YAML:1.0\n---\n", size = "img_size: [1024, 768]\n";
  for (const Matrix& matrix : {Matrix(storage), Matrix(nested), Matrix(block), Matrix(flat)}) {
    expect_taken(head + size + matrices(matrix));
    expect_taken(matrices(matrix) + size);
    expect_taken("# by hand\n\n" + head + matrices(matrix) +
                 "image_width: 1024\nimage_height: 768\n");
  }
  expect_taken("{\n" + matrices(json) + "\"imageSize\": [1024, 768]\n}\n");
  expect_taken(head + matrices(nested) + storage("resolution", 2, {1024, 768}));
  expect_refused([&] { read(head + size + with(matrices(nested), "tvec: [[", "tvec: [[x], [")); },
                 "cam0.yml, line 7: tvec is no matrix of cv::FileStorage");
  expect_refused([&] { read(size + with(matrices(flat), "mtx: [", "mtx: [.nan, ")); },
                 "cam0.yml, line 2: mtx is no matrix");
  expect_refused([&] { read(size + with(matrices(flat), "mtx: [", "mtx: [1, ")); },
                 "cam0.yml, line 2: the camera matrix has 10 numbers, expected 9");
  expect_refused([&] { read(head + "size: 30\n" + matrices(flat)); }, "does not say the pictures'");
  expect_refused([&] { read("img_size: [768, 1024]\n" + matrices(flat)); },
                 "its pictures of 768x1024 have the principal point (512, 384), as if height");
  const std::string degrees = size + flat("mtx", 3, numbers(one_camera().cameras[0].K)) +
                              "rotation: [0, 90, 5]\ntvec: [0, 0, 3]\n";
  expect_refused([&] { read(degrees); }, "theirs is 90.14; of angles in degrees make a matrix R");
  EXPECT_EQ(read(with(degrees, "90, 5", "1.5, 0")).cameras[0].R, import::rotation_of({0, 1.5, 0}));
  // A list in a list in a list, and one that stands for thousands.
  expect_refused([&] { read("mtx: " + std::string(30, '[') + std::string(30, ']') + "\n"); },
                 "cam0.yml: not an OpenCV XML or YAML file");
  std::string many = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
  for (char c = 'b'; c < 'j'; ++c)
    many += fmt::format("{0}: &{0} [*{1}, *{1}, *{1}, *{1}, *{1}, *{1}, *{1}, *{1}, *{1}]\n", c,
                        static_cast<char>(c - 1));
  expect_refused([&] { read(many); }, "cam0.yml: not an OpenCV XML or YAML file");
}

TEST(RigImportOpenCv, XmlWithoutItsHeading) {
  const Matrix xml = [](const std::string& name, int columns, const std::vector<double>& values) {
    return fmt::format(
        "<{0} "
        "type_id=\"opencv-matrix\">\n<rows>{1}</rows><cols>{2}</cols><dt>d</dt>\n<data>{3}</data>"
        "</{0}>\n",
        name, values.size() / columns, columns, listed(values, 0, values.size(), " "));
  };
  const std::string text =
      "<opencv_storage>\n<imageSize>1024 768</imageSize>\n" + matrices(xml) + "</opencv_storage>\n";
  expect_taken("<?xml version=\"1.0\"?>\n" + text);
  expect_taken("\n" + text);
  expect_refused([&] { read(with(text, "</mtx>", "</mt>")); },
                 "cam0.yml, line 5: not an OpenCV XML or YAML file: ");
}

// EasyMocap's intri.yml and extri.yml, whose rotations are there as vectors, too.
TEST(RigImportOpenCv, EasyMocapsCameras) {
  const std::string folder = empty_folder(), head = "%YAML:1.0\n---\n";
  Rig truth = with_lenses();
  for (const bool sized : {false, true}) {
    for (const std::string number : {"0", "1", "01", "C1_"}) {
      std::string names = "names:\n", lenses, poses;
      for (std::size_t i = 0; i < 4; ++i) {
        Camera& camera = truth.cameras[i];
        camera.name = number + std::to_string(i + 1);
        names += "   - \"" + camera.name + "\"\n";
        lenses += storage("K_" + camera.name, 3, numbers(camera.K)) +
                  storage("dist_" + camera.name, 4, camera.distortion);
        if (sized) lenses += fmt::format("H_{0}: 768\nW_{0}: 1024\n", camera.name);
        poses += storage("R_" + camera.name, 1, numbers(rodrigues(camera.R))) +
                 storage("Rot_" + camera.name, 3, numbers(camera.R)) +
                 storage("T_" + camera.name, 1, numbers(camera.t));
      }
      const std::string intri = folder + "/intri.yml", extri = folder + "/extri.yml";
      write_text(head + names + lenses, intri);
      write_text(head + names + poses, extri);
      import::Options options;
      if (!sized) {
        expect_refused([&] { import::opencv({intri, extri}, options); }, "give it with --size");
        options.width = 1024;
        options.height = 768;
      }
      for (const auto& files : {std::vector{intri, extri}, std::vector{extri, intri}}) {
        const Rig rig = import::opencv(files, options);
        expect_same(rig, truth);
        EXPECT_EQ(rig.cameras[3].distortion, truth.cameras[3].distortion);
      }
    }
  }
}

TEST(RigImportOpenCv, FisheyesAreRefusedOrNoted) {
  const std::string size = "width: 1024\nheight: 768\n";
  for (const char* line : {"calibration_model: fisheye\n", "lens_type: 'Fisheye 180'\n",
                           "use_fisheye_model: 1\n", "projection: equidistant\n"})
    expect_refused([&] { read(line + size + matrices(flat)); }, "are those of another model than");
  for (const char* line :
       {"fisheye_model: 0\n", "camera_name: fisheye 1\n", "model_type: PINHOLE\n"})
    expect_same(read(line + size + matrices(flat)), one_camera());
  std::vector<std::string> notes;
  import::Options options;
  options.note = [&](const std::string& note) { notes.push_back(note); };
  read(size + matrices(flat), options);
  EXPECT_TRUE(notes.empty());
  read("DIM: [1024, 768]\n" + matrices(flat), options);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("the size is called DIM"), std::string::npos) << notes[0];
  notes.clear();
  read(size + with(matrices(flat), "0.001, 0.002", "-0.05, 0.03"), options);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("cam0.yml: of its four distortion coefficients the last two, -0.05 and "
                          "0.03, are taken for p1 and p2"),
            std::string::npos)
      << notes[0];
}

TEST(RigImportOpenCv, WhatIsNoCameraIsSaidBeforeWhatItLacks) {
  expect_same(read("image_size: {width: 1024, height: 768}\n" + matrices(flat)), one_camera());
  for (const char* text : {"cameras: {cam0: {K: [1], dist: [0]}}\nposes: {cam0: {R: [1]}}\n",
                           "{\"name\": \"hall\", \"cameras\": [{\"K\": [[1]]}]}",
                           "cam0: {intrinsics: [1, 2, 3, 4]}\n"})
    expect_refused([&] { read(text); }, ". Cameras within lists are not read");
  expect_refused([] { read("fx: 700\nfy: 700\n"); }, "and the file has fx, fy.");
  // The message as `rostopic echo` prints it, whose R is no pose.
  expect_refused(
      [] {
        read(
            "height: 768\nwidth: 1024\ndistortion_model: plumb_bob\nD: [0, 0, 0, 0]\n"
            "K: [700, 0, 511, 0, 700, 383, 0, 0, 1]\nR: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
            "binning_x: 0\n");
      },
      "this is the form of ROS's camera_info");
}

TEST(RigImportOpenCv, FilesOfOtherProgramsAreNamed) {
  const std::pair<const char*, const char*> files[] = {
      {"<?xml version=\"1.0\"?>\n<document version=\"1.5.0\"><chunk><cameras><camera id=\"0\"/>"
       "</cameras></chunk></document>\n",
       "Metashape's file of cameras"},
      {"<?xml version=\"1.0\"?>\n<calibration><projection>frame</projection></calibration>\n",
       "a lens alone"},
      {"{\"fl_x\": 7, \"frames\": [{\"transform_matrix\": [[1, 0, 0, 0]]}]}", "transforms.json"},
      {"{\"views\": [], \"intrinsics\": [], \"poses\": []}", "Meshroom"},
      {"# Bundle file v0.3\n4 0\n", "Bundler"},
      {"NVM_V3\n\n4\n", "VisualSFM"}};
  for (const auto& [text, name] : files) {
    expect_refused([&, text = text] { read(text); }, name);
    expect_refused([&, text = text] { read(text); }, "COLMAP's text model");
  }
  // Whatever an OpenCV file has besides.
  const std::string size = "image_size: [1024, 768]\n";
  expect_taken("{\n\"views\": 4,\n\"poses\": 4,\n" +
               with(matrices(json), "\"mtx\"", "\"intrinsics\"") +
               "\"imageSize\": [1024, 768]\n}\n");
  expect_taken("# Bundle file\nmaker: NVM_V3\n" + size + matrices(flat));
  expect_refused([] { read("fx: 700\n# Bundle file\nmaker: NVM_V3\n"); }, "no camera matrix");
}

}  // namespace
}  // namespace polyhull
