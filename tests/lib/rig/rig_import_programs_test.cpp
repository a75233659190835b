// SPDX-License-Identifier: LGPL-2.1-or-later
// Other programs' calibrations in the forms that people have: by hand, in part, of other models.
#include <algorithm>
#include <cmath>
#include "lib/rig/import_support.h"

#include "rig/check.h"
#include "rig/export.h"

namespace polyhull {
namespace {

namespace fs = std::filesystem;
using namespace std::string_literals;

// COLMAP's two files in a folder.
struct Model {
  std::string folder = empty_folder(), cameras, images;
  std::vector<std::string> notes;

  explicit Model(const Rig& rig) {
    exported::colmap(rig, folder);
    cameras = read_text(folder + "/cameras.txt");
    images = read_text(folder + "/images.txt");
  }
  Rig import() {
    write_text(cameras, folder + "/cameras.txt");
    write_text(images, folder + "/images.txt");
    import::Options options;
    options.note = [this](const std::string& text) { notes.push_back(text); };
    return import::colmap(folder, options);
  }
};

// default_rig()'s images renamed, %d being 1 to 4.
std::string renamed(std::string images, const std::string& pattern) {
  for (int i = 0; i < 4; ++i)
    images = with(images, fmt::format("cam{}.png", i), with(pattern, "%d", std::to_string(i + 1)));
  return images;
}

TEST(RigImportPrograms, ColmapsNamesWithBlanksAndFolders) {
  for (const auto& [files, names] :
       std::vector<std::pair<std::string, std::string>>{{"Stage Cam (%d).jpg", "Stage Cam (%d)"},
                                                        {"left eye, #%d.JPG", "left eye, #%d"},
                                                        {"cam%d/000001.jpg", "cam%d"},
                                                        {"take 2\\cam %d\\000001.jpg", "cam %d"},
                                                        {"a/%d.jpg", "%d"},
                                                        {"cam%d/images/000001.jpg", "cam%d"},
                                                        {"cam%d/GX01002%d.jpg", "cam%d"},
                                                        {"t/cam%d/img/GX%d.jpg", "cam%d"}}) {
    Rig truth = with_lenses();
    Model model(truth);
    model.images = renamed(model.images, files);
    for (int i = 0; i < 4; ++i) truth.cameras[i].name = with(names, "%d", std::to_string(i + 1));
    expect_same(model.import(), truth);
    EXPECT_TRUE(model.notes.empty());
  }
  // Two folders with two cameras each.
  Model model(with_lenses());
  for (const auto& [from, to] :
       {std::pair{"cam0", "a/0"}, {"cam1", "a/1"}, {"cam2", "b/0"}, {"cam3", "b/1"}})
    model.images = with(model.images, from, to);
  const Rig rig = model.import();
  ASSERT_EQ(rig.cameras.size(), 4u);
  EXPECT_EQ(rig.cameras[2].name, "b/0");
  EXPECT_EQ(import::names_of({"here/../x/1.yml", "./x/2.yml"}),
            (std::vector<std::string>{"1", "2"}));
  model.images = with(with(model.images, "a/", "a/images/"), "b/", "b/images/");
  EXPECT_EQ(model.import().cameras[2].name, "b/0");
}

// As COLMAP finds the poses of still cameras: each instant's a little apart.
TEST(RigImportPrograms, ColmapsInstantsAreOneCamera) {
  Rig truth = with_lenses(), later = truth;
  for (Camera& camera : later.cameras) camera.t += Vec3(0.004, 0.0, -0.002);
  Model model(truth), second(later);
  for (const char* names : {"cam%d/00000", "shot_%d_"}) {
    Model both(truth);
    both.images =
        renamed(model.images, names + "1.jpg"s) + renamed(second.images, names + "2.jpg"s);
    const bool folders = both.images.find('/') != both.images.npos;
    for (int i = 0; i < 4; ++i)
      truth.cameras[i].name = fmt::format(fmt::runtime(folders ? "cam{}" : "shot_{}_1"), i + 1);
    expect_same(both.import(), truth);
    ASSERT_EQ(both.notes.size(), 1u);
    EXPECT_NE(both.notes[0].find("2.jpg"), std::string::npos) << both.notes[0];
  }
  // Of one whose instants are found farther apart each is a camera, which is said.
  later.cameras[1].t.x += 0.15;
  Model apart(truth);
  apart.images = renamed(model.images, "cam%d/1.jpg") + renamed(Model(later).images, "cam%d/2.jpg");
  const Rig rig = apart.import();
  EXPECT_EQ(rig.cameras.size(), 5u);
  Vec3 low(HUGE_VAL), high(-HUGE_VAL);
  for (const Camera& camera : rig.cameras) {
    low = glm::min(low, camera.centre());
    high = glm::max(high, camera.centre());
  }
  const double moved = glm::length(later.cameras[1].centre() - truth.cameras[1].centre());
  ASSERT_EQ(apart.notes.size(), 2u);
  EXPECT_NE(apart.notes[1].find(fmt::format(
                "camera 2 becomes 2 cameras ('cam2/1.jpg', 'cam2/2.jpg', and so on): these images "
                "stand up to {:.1f} % of the rig's size and 0.0 degrees apart",
                100.0 * moved / glm::length(high - low))),
            std::string::npos)
      << apart.notes[1];
  // A turntable before one camera is of many cameras.
  Model table(with_lenses());
  for (const char* id : {" 2 cam", " 3 cam", " 4 cam"})
    table.images = with(table.images, id, " 1 cam");
  EXPECT_EQ(table.import().cameras.size(), 4u);
  EXPECT_TRUE(table.notes.empty());
}

// Where COLMAP is not told otherwise, each picture is of a camera of its own.
TEST(RigImportPrograms, ColmapsInstantsOfCamerasOfTheirOwn) {
  const Rig truth = with_lenses();
  const Model model(truth);
  Model both(truth);
  both.images = renamed(model.images, "cam%d/1.jpg");
  for (int i = 4; i >= 1; --i) {
    both.cameras =
        with(both.cameras, fmt::format("\n{} OPENCV", i), fmt::format("\n1{} OPENCV", i));
    both.images = with(both.images, fmt::format(" {} cam", i), fmt::format(" 1{} cam", i));
  }
  both.cameras += model.cameras;
  both.images += renamed(model.images, "cam%d/2.jpg");
  const Rig rig = both.import();
  ASSERT_EQ(rig.cameras.size(), 4u);
  EXPECT_EQ(rig.cameras[3].name, "cam4");
  ASSERT_EQ(both.notes.size(), 1u);
  EXPECT_NE(both.notes[0].find("only the first is taken"), std::string::npos) << both.notes[0];
  // The folder by one of its files.
  expect_same(import::colmap(both.folder + "/images.txt", {}), rig);
  // Two cameras side by side in a folder of all are two.
  Model pair(truth);
  pair.cameras += "9 PINHOLE 1024 768 700 700 512 384\n";
  pair.images = renamed(model.images, "all/%d.png");
  pair.images += with(pair.images.substr(pair.images.find("\n1 ") + 1,
                                         pair.images.find("\n2 ") - pair.images.find("\n1 ")),
                      " 1 all/1.png", " 9 all/9.png");
  EXPECT_EQ(pair.import().cameras.size(), 5u);
}

TEST(RigImportPrograms, ColmapsFilesByHand) {
  const Rig truth = with_lenses();
  const auto refuses = [&](const std::function<void(Model&)>& change, const std::string& part) {
    Model model(truth);
    change(model);
    expect_refused([&] { model.import(); }, part);
  };
  const std::string head = "1 0.5 0.5 0.5 0.5 0 0 3 1 cam0.png\n";
  refuses([](Model& m) { m.images = with(m.images, "\n\n", "\n"); },
          "images.txt, line 4: the second line of image 'cam0.png' must be empty");
  refuses([&](Model& m) { m.images = head + "1 2 3 4\n"; }, "images.txt, line 2: the second line");
  refuses([&](Model& m) { m.images = head + "1 2 x\n"; }, "images.txt, line 2: the second line");
  // Names of numbers, and no second lines.
  refuses([&](Model& m) { m.images = with(with(m.images, "\n\n", "\n"), "cam", "1 2 "); },
          "images.txt, line 4: the second line of image '1 2 0.png'");
  refuses(
      [&](Model& m) {
        m.images = with(with(with(m.images, "\n\n", "\n"), "cam", "1 2 "), ".png", "");
      },
      "images.txt, line 4: the second line of image '1 2 0'");
  refuses([&](Model& m) { m.images = "\n1 0 0 3 1 0 0 0.1 1 cam0.png\n"; },
          "images.txt, line 2: the rotation's quaternion (columns 2 to 5, qw qx qy qz) has length "
          "3.16");
  refuses([&](Model& m) { m.images = with(head, " ", ", "); }, "line 1: expected: id qw qx");
  refuses([&](Model& m) { m.images = with(head, " ", ","); }, "no commas");
  refuses([&](Model& m) { m.cameras = with(m.cameras, " OPENCV ", ",OPENCV,"); }, "no commas");
  refuses([&](Model& m) { m.images = with(head, " cam0.png", ""); }, "line 1: expected");
  refuses([&](Model& m) { m.images = with(head, "0.5", "nan"); }, "line 1: expected");
  refuses([](Model& m) { m.cameras = "1,OPENCV,9,9,700,700,5,5,0,0,0,0\n"; },
          "cameras.txt, line 1: expected: id model width height parameters, with blanks");
  refuses([](Model& m) { m.cameras = "1 PINHOLE 9 9 700 700 5 5x\n"; }, "cameras.txt, line 1");
  refuses([](Model& m) { m.cameras += "4 PINHOLE 9 9 700 700 5 5\n"; },
          "there is a camera 4 before");
  // Comments, blank lines between, points, and no second line at the end.
  Model model(truth);
  model.images = with(with(model.images, "\n\n", "\n1.5 2.5 -1 3 4 17\n\n"),
                      "\n1.5 2.5 -1 3 4 17\n\n2 ", "\n# no points\n2 ");
  while (model.images.back() != 'g') model.images.pop_back();
  expect_same(model.import(), truth);
  // An empty line behind each line.
  model.images = with(with(model.images, "# no points", "1.5 2.5 -1 3 4 17"), "\n", "\n\n");
  model.cameras = with(model.cameras, "\n", "\n\n");
  expect_same(model.import(), truth);
  refuses([&](Model& m) { m.images = head + "\n2 1 0 0 0 0 0 3 1\n"; }, "line 3: expected: id qw");
}

TEST(RigImportPrograms, KalibrsChains) {
  const Rig truth = with_lenses();
  const std::string text = exported::kalibr(truth);
  const auto read = [](const std::string& chain) { return import::parse_kalibr(chain, "chain"); };
  expect_same(read("%YAML:1.0\n---\n" + text), truth);
  expect_same(read("%YAML:1.0\n\n" + text), truth);
  // Keys from 3 on, in another order.
  std::string later = text;
  for (int i = 3; i >= 0; --i)
    later = with(later, fmt::format("cam{}:", i), fmt::format("cam{}:", i + 3));
  expect_same(read(later), truth);
  const std::size_t last = later.find("cam6:");
  Rig turned = read(later.substr(last) + later.substr(0, last));
  expect_same(turned, truth);
  // The chain alone, whose first camera is the world.
  const Rig chain = read(with(later, "T_cam_imu", "T_other"));
  const Vec3 step = truth.cameras[0].to_camera(truth.cameras[3].centre());
  EXPECT_LT(glm::length(chain.cameras[3].centre() - step), 1e-9);

  // As drivers write it, of cameras whose size is not told.
  std::string others = with(with(text, "radtan", "plumb_bob"), "0.002]", "0.002, 0.0]");
  EXPECT_EQ(read(others).cameras[0].distortion.size(), 5u);
  others = with(others, "resolution", "size");
  expect_refused([&] { read(others); }, "resolution is missing; give the pictures' size as --size");
  import::Options sized;
  sized.width = 1024;
  sized.height = 768;
  expect_same(import::parse_kalibr(others, "chain", sized), truth);
  others = with(others, "0.0]", "0.0, 0.0]");

  std::string back;
  for (std::size_t i = 0; i < 4; ++i) {
    const Camera& camera = truth.cameras[i];
    const Mat3 R = glm::transpose(camera.R);
    const auto r = to_rows(R);
    const Vec3 t = -(R * camera.t);
    back += fmt::format(
        "cam{}:\n  T_imu_cam: # from the camera\n    - [{}, {}, {}, {}]\n    - [{}, {}, {}, {}]\n"
        "    - [{}, {}, {}, {}]\n    - [0.0, 0.0, 0.0, 1.0]\n  camera_model: pinhole\n"
        "  distortion_model: none\n  intrinsics: [700, 700, 511.5, 383.5]\n"
        "  resolution: [1024, 768]\n  rostopic: /one/image_raw\n",
        i, r[0], r[1], r[2], t.x, r[3], r[4], r[5], t.y, r[6], r[7], r[8], t.z);
  }
  expect_same(read(back), truth);  // and the topic that all have names none

  const auto refuses = [&](const std::string& from, const std::string& to,
                           const std::string& part) {
    expect_refused([&] { read(with(text, from, to)); }, part);
  };
  refuses("cam1:\n  camera_model", "left:\n  was", ": cam1 is missing between cam0 and cam2");
  refuses("cam2:", "cam1:", "cam1 is there a second time, after line");
  refuses("cam3:", "cam7:", ": cam3 is missing between cam2 and cam7");
  refuses("cam0:", "left:", "line 1: the camera 'left' must be called cam and a number");
  const std::string one_other =
      with(text, "cam3:\n  camera_model: pinhole\n", "cam3:\n  camera_model: omni\n");
  expect_refused([&] { read(one_other); }, "cam3: the camera model omni");
}

// As other programs write the chain: a transform's numbers in one list or as cv::FileStorage's
// matrix, and with a last row that was computed.
TEST(RigImportPrograms, KalibrsTransformsInOtherForms) {
  const Rig truth = with_lenses();
  const char* before[] = {"[", "\n    - [", " !!opencv-matrix\n    rows: 4\n    data: ["};
  const char* between[] = {", ", "]\n    - [", ",\n      "};
  for (int form = 0; form < 3; ++form) {
    std::string text;
    for (std::size_t i = 0; i < 4; ++i) {
      const Camera& camera = truth.cameras[i];
      text += fmt::format(
          "cam{}:\n  camera_model: pinhole\n  distortion_model: none\n"
          "  intrinsics: [700, 700, 511.5, 383.5]\n  resolution: [1024, 768]\n"
          "  rostopic: /cam{}/image_raw\n  T_cam_imu: {}",
          i, i, before[form]);
      const auto r = to_rows(camera.R);
      for (int row = 0; row < 3; ++row)
        text += fmt::format("{}, {}, {}, {}{}", r[3 * row], r[3 * row + 1], r[3 * row + 2],
                            camera.t[row], between[form]);
      text += "1.0e-17, -0.0, 0, 1.0000000000000002]\n";
    }
    expect_same(import::parse_kalibr(text, "chain"), truth);
    expect_refused([&] { import::parse_kalibr(with(text, "-0.0", "0.1"), "chain"); },
                   "cam0: the last row of T_cam_imu must be 0 0 0 1");
    expect_refused([&] { import::parse_kalibr(with(text, ", -0.0", ""), "chain"); },
                   "line 1, cam0: T_cam_imu must");
  }
}

// OpenCV's file of the first camera of default_rig(), changed.
void opencv_file(const std::string& path, const std::function<std::string(std::string)>& change) {
  const std::string folder = fs::path(path).parent_path() / "opencv";
  exported::opencv(with_lenses(), folder);
  write_text(change(read_text(folder + "/cam0.yml")), path);
}

TEST(RigImportPrograms, OpenCvsFiles) {
  const std::string path = empty_folder() + "/cam0.yml";
  Rig truth = with_lenses();
  truth.cameras.resize(1);
  const auto takes = [&](const std::function<std::string(std::string)>& change) {
    opencv_file(path, change);
    expect_same(import::opencv({path}, {}), truth);
  };
  const auto refuses = [&](const std::function<std::string(std::string)>& change,
                           const std::string& part) {
    opencv_file(path, change);
    expect_refused([&] { import::opencv({path}, {}); }, part);
  };
  const auto line = [](const std::string& text) {
    return [text](const std::string& file) {
      return with(file, "image_width", text + "\nimage_width");
    };
  };
  takes(line("fisheye_model: 0"));
  takes(line("distortion_model: plumb_bob"));
  takes([](const std::string& file) {
    return with(with(with(with(file, "image_width", "image_Width"), "image_height", "image_Height"),
                     "camera_matrix", "Camera_Matrix"),
                "distortion_coefficients", "Distortion_Coefficients");
  });
  takes(
      [](const std::string& file) { return with(file, "image_width: 1024", "imageWidth: 1024."); });
  refuses(line("fisheye_model: 1"), "cam0.yml, line 3: fisheye_model is 1");
  refuses(line("fisheye: true"), "line 3: fisheye is true");
  refuses(line("distortion_model: equidistant"), "line 3: distortion_model is equidistant");
  refuses(
      [](const std::string& file) {
        return with(file.substr(0, file.find("R:")), "image_width",
                    "extrinsic_parameters: !!opencv-matrix\n   rows: 1\n   cols: 6\n   dt: d\n"
                    "   data: [ 0., 0., 0., 0., 0., 1. ]\nimage_width");
      },
      "cam0.yml, line 3: extrinsic_parameters holds poses of the board");
  refuses(
      [](const std::string& file) { return with(file, "7.0000000000000000e+02, 0", ".Nan, 0"); },
      "camera_matrix holds a number that is not finite (NaN)");
  refuses([](const std::string& file) { return "by hand\n" + with(file, "%YAML:1.0", ""); },
          "begin with %YAML:1.0");
  refuses([](const std::string& file) { return with(file, "   dt: d\n", ""); },
          "line 5: camera_matrix is no matrix of cv::FileStorage");
  refuses([](const std::string& file) { return with(file, "rows: 3", "rows: 1000000000"); },
          "line 5: camera_matrix is no matrix of cv::FileStorage");
  refuses([](const std::string& file) { return with(file, "image_height:", "image_height: ["); },
          "cam0.yml, line 5: not an OpenCV XML or YAML file: ");
  const std::string ros =
      "image_width: 640\nimage_height: 480\ncamera_name: left\ncamera_matrix:\n  rows: 3\n"
      "  cols: 3\n  data: [600, 0, 320, 0, 600, 240, 0, 0, 1]\ndistortion_model: plumb_bob\n";
  for (const std::string head : {"", "%YAML:1.0\n---\n"})
    refuses([&](const std::string&) { return head + ros; },
            "this is the form of ROS's camera_info");
  refuses(
      [&](const std::string&) {
        return "# oST version 5.0 parameters\n\n[image]\n\nwidth\n640\n"
               "[narrow_stereo]\n\ncamera matrix\n600 0 320\n"s;
      },
      "this is the form of ROS's camera_info");
  // The last of fourteen coefficients tilt the sensor.
  const auto lens = [](const std::string& tilt) {
    return [tilt](const std::string& file) {
      const std::size_t from = file.find("distortion_coefficients"), to = file.find("R:");
      return file.substr(0, from) +
             "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 14\n   dt: d\n   "
             "data: "
             "[ -0.1, 0.02, 0., 0., 0., 0.1, 0., 0., 0., 0., 0., 0., " +
             tilt + ", 0. ]\n" + file.substr(to);
    };
  };
  takes(lens("0."));
  refuses(lens("0.01"), "tilt the sensor");
}

TEST(RigImportPrograms, OpenCvsLensesUnderOtherNames) {
  const std::string path = empty_folder() + "/cam0.yml";
  Rig truth = with_lenses();
  truth.cameras.resize(1);
  const std::string usual = "distortion_coefficients: ";
  for (const std::string name :
       {"distortion", "kc", "distortion_parameters", "dist", "distCoeffs", "Distortion_Vector"}) {
    opencv_file(path, [&](const std::string& file) { return with(file, usual, name + ": "); });
    const Rig rig = import::opencv({path}, {});
    expect_same(rig, truth);
    EXPECT_EQ(rig.cameras[0].distortion, truth.cameras[0].distortion) << name;
  }
  const auto without = [&](const std::string& instead) {
    opencv_file(path, [&](const std::string& file) {
      const std::size_t from = file.find(usual), to = file.find("R:");
      return file.substr(0, from) + instead + file.substr(to);
    });
    return import::opencv({path}, {}).cameras[0].distortion;
  };
  EXPECT_EQ(without("k1: -0.1\nk2: 0.02\np1: 1\n"), (std::vector<double>{-0.1, 0.02, 1, 0}));
  EXPECT_EQ(without("k1: -0.1\nk3: 0.02\n"), (std::vector<double>{-0.1, 0, 0, 0, 0.02}));
  EXPECT_EQ(without("distance: 3\ndistortion_model: plumb_bob\n"), std::vector<double>());
  expect_refused([&] { without("k1: 0.1\nk2: 0.1\nk3: 0.1\nk4: 0.1\n"); }, "cam0.yml, line 13: k4");
  const std::string matrix =
      ": !!opencv-matrix\n   rows: 1\n   cols: 4\n   dt: d\n"
      "   data: [ 0.1, 0., 0., 0. ]\n";
  expect_refused([&] { without("distortion: { k1: 0.1, k2: 0.2 }\n"); }, "line 10: distortion");
  expect_refused([&] { without("lens_dist" + matrix); }, "line 10: lens_dist looks like");
  expect_refused([&] { without(usual.substr(0, usual.size() - 2) + matrix + "xi: 1.5\n"); },
                 "line 15: xi is of OpenCV's omnidirectional model");
}

TEST(RigImportPrograms, OpenCvsStereoPairs) {
  const std::string folder = empty_folder();
  Rig truth = with_lenses();
  truth.cameras.resize(2);
  Camera &left = truth.cameras[0], &right = truth.cameras[1];
  const Mat3 R = right.R * glm::transpose(left.R);
  const Vec3 T = right.t - R * left.t;
  const auto matrix = [](const std::string& name, int columns, const auto& values) {
    std::string numbers;
    for (const double value : values)
      numbers += fmt::format("{}{:.17e}", numbers.empty() ? "" : ", ", value);
    return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n",
                       name, values.size() / columns, columns, numbers);
  };
  const std::string pose = matrix("R", 3, to_rows(R)) +
                           matrix("T", 1, std::array<double, 3>{T.x, T.y, T.z}) +
                           matrix("R1", 3, to_rows(Mat3(1.0)));
  const std::string size = "image_width: 1024\nimage_height: 768\n";
  left.R = Mat3(1.0);
  left.t = Vec3(0.0);
  right.R = R;
  right.t = T;
  left.name = "left";
  right.name = "right";
  const auto files = [&](const std::vector<std::string>& texts) {
    std::vector<std::string> paths;
    for (const std::string& text : texts) {
      paths.push_back(fmt::format("{}/{}.yml", folder, paths.size()));
      write_text("%YAML:1.0\n---\n" + text, paths.back());
    }
    return import::opencv(paths, {});
  };
  const auto lenses = [&](const std::array<std::string, 4>& names) {
    return size + matrix(names[0], 3, to_rows(left.K)) + matrix(names[1], 4, left.distortion) +
           matrix(names[2], 3, to_rows(right.K)) + matrix(names[3], 4, right.distortion);
  };
  for (const std::array<std::string, 4>& names :
       {std::array<std::string, 4>{"M1", "D1", "M2", "D2"},
        {"K1", "D1", "K2", "D2"},
        {"cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2"},
        {"camera_matrix_left", "dist_coeffs_left", "camera_matrix_right", "dist_coeffs_right"},
        {"left_K", "left_D", "right_K", "right_D"},
        {"K0", "D0", "K1", "D1"}}) {
    for (const Rig& rig : {files({lenses(names) + pose}), files({lenses(names), pose}),
                           files({pose, lenses(names)})}) {
      expect_same(rig, truth);
      EXPECT_EQ(rig.cameras[1].distortion, right.distortion);
    }
  }
  const std::string usual = lenses({"M1", "D1", "M2", "D2"});
  expect_refused([&] { files({usual}); }, "0.yml: no rotation");
  expect_refused([&] { files({usual + pose, usual + pose}); }, "give one pair");
  expect_refused([&] { files({usual + matrix("M3", 3, to_rows(left.K)) + pose}); },
                 "more than two cameras");
  expect_refused(
      [&] {
        files({lenses({"M1", "dist_a", "M2", "D2"}) + pose});
      },
      "dist_a looks like a lens's distortion");
}

TEST(RigImportPrograms, BouguetsBoards) {
  const std::string folder = empty_folder();
  const std::string text =
      "fc = [ 700 ; 630 ];\ncc = [ 511.5 ; 383.5 ];\nkc = [ 0 ; 0 ; 0 ; 0 ; 0 ];\nnx = 1024;\n"
      "ny = 768;\nomc_1 = [ NaN ; NaN ; NaN ];\nTc_1 = [ NaN ; NaN ; NaN ];\n"
      "omc_2 = [ 3.0e+000 ; 1.0D-001 ; +0.2 ];\nTc_2 = [ 0 ; 0 ; 3 ];\n"
      "omc_3 = [ 3 ; 0 ; 0 ];\nTc_3 = [ 0 ; 0 ; 3 ];\n";
  const std::vector<std::string> files{folder + "/a.m", folder + "/b.m"};
  const auto write = [&](const std::string& a, const std::string& b) {
    write_text(a, files[0]);
    write_text(b, files[1]);
  };
  const auto refuses = [&](int board, const std::string& part) {
    import::Options options;
    options.board = board;
    expect_refused([&] { import::bouguet(files, options); }, part);
  };
  write(text, text);
  refuses(1, "a.m, line 6: picture 1 was not used in this calibration; boards 2 and 3 are; choose");
  refuses(9, "there is no picture 9 (omc_9) in this calibration; boards 2 and 3 are");
  import::Options options;
  options.board = 2;
  const Rig rig = import::bouguet(files, options);
  EXPECT_EQ(rig.cameras[0].R, import::rotation_of(Vec3(3, 0.1, 0.2)));
  const auto notes = examine_rig(rig).warnings;
  EXPECT_TRUE(std::ranges::any_of(notes, [](const std::string& note) {
    return note == "a has pixels that are not square: fx / fy is 1.111";
  }));
  // Fields of structures and blocks of comments set nothing.
  write(text + "other.fc = [ 1 ; 1 ];\n%{\nfc = [ 1 ; 1 ];\n%{\n%}\ncc = [ 1 ; 1 ];\n%}\n", text);
  expect_same(import::bouguet(files, options), rig);
  write(text, with(text, "omc_3 = [ 3 ; 0", "omc_3 = [ 3 ; Inf"));
  refuses(3, "b.m, line 10: picture 3 was not used in this calibration; board 2 is; choose");
  refuses(1, "boards 2 and 3 are, and in all files board 2 is; choose");
  write(text, with(with(text, "omc_3", "omc_4"), "omc_2", "omc_5"));
  refuses(1, "boards 2 and 3 are, but none in all files");
  write(text, with(with(text, "omc_3 = [ 3", "omc_3 = [ nan"), "3.0e+000", "nan"));
  refuses(2, "picture 2 was not used in this calibration, nor was any other");
  write(with(text, "kc = [ 0 ; 0 ;", "kc = [ 0 ;"), text);
  refuses(2, "a.m, line 3: kc has 4 numbers, expected 5 (k1 k2 p1 p2 k3): the toolbox's fisheye");
  write(with(text, "fc = [ 700", "fc = [ NaN"), text);
  refuses(2, "a.m, line 1: fc holds nan");
}

}  // namespace
}  // namespace polyhull
