// SPDX-License-Identifier: LGPL-2.1-or-later
// Boards found in rendered pictures, and polyhull-calibrate from folders of them to rig and report.
#include "studio/calibration/find_board.h"

#include <fmt/format.h>
#include <gst/gst.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <random>
#include <sstream>

#include "base/error.h"
#include "builtin/default_rig.h"
#include "calibrate/input.h"
#include "floor_points.h"
#include "support/calibration_takes.h"
#include "support/folder.h"
#include "support/refusal.h"
#include "support/run_kind.h"

namespace polyhull::calibration {
namespace {

namespace fs = std::filesystem;

Target chessboard(int columns, int rows) {
  return {{columns, rows, 0.1}, 0.75, ""};
}

Target charuco(int columns, int rows) {
  return {{columns, rows, 0.1, true}, 0.75, "4X4_100"};
}

Camera small_camera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.K = from_rows({560.0, 0.0, 315.0, 0.0, 561.0, 243.0, 0.0, 0.0, 1.0});
  camera.distortion = {-0.1, 0.05, 1e-3, -5e-4, 0.0};
  return camera;
}

// The board's middle 1.4 m before the camera, turned about all axes.
Pose turned(const Board& board, double yaw, double pitch, double roll, double distance) {
  const Mat3 R = from_parameters(std::array{0.0, yaw, 0.0, 0.0, 0.0, 0.0}.data()).R *
                 from_parameters(std::array{pitch, 0.0, 0.0, 0.0, 0.0, 0.0}.data()).R *
                 from_parameters(std::array{0.0, 0.0, roll, 0.0, 0.0, 0.0}.data()).R;
  return {R, Vec3(0.02, -0.03, distance) - R * board.middle()};
}

// Root mean square distance of what was found from the truth, numbers included.
double error_in(const Target& target, const Pose& pose, const Camera& camera) {
  const BoardFinder finder(target);
  const auto view = finder.find(render_board(finder.draw(64), target.board, pose, camera));
  if (!view) return INFINITY;
  EXPECT_TRUE(target.board.named || static_cast<int>(view->ids.size()) == target.board.count());
  return view_error(target.board, *view, camera, pose);
}

TEST(FindBoard, CornersAndTheirNumbers) {
  const Camera camera = small_camera();
  for (const Target& target : {chessboard(9, 6), chessboard(6, 7), charuco(7, 5), charuco(6, 5)}) {
    for (const double roll : {0.0, 1.7, 3.1, -1.2}) {
      const Pose pose = turned(target.board, 0.4, -0.3, roll, 1.4);
      EXPECT_LT(error_in(target, pose, camera), target.board.named ? 0.15 : 0.08)
          << target.board.columns << "x" << target.board.rows << " " << roll;
    }
  }
}

TEST(FindBoard, NothingWhereThereIsNone) {
  const Picture grey{320, 240, 1, std::vector<std::uint8_t>(320 * 240, 120)};
  for (const Target& target : {chessboard(9, 6), charuco(7, 5)})
    EXPECT_FALSE(BoardFinder(target).find(grey));
  // Noise is full of quadrangles: looking for a board on the floor takes a second, not minutes.
  Picture noise{240, 180, 1, {}};
  std::minstd_rand random(7);
  std::normal_distribution<double> level(110.0, 50.0);
  for (int i = 0; i < noise.width * noise.height; ++i)
    noise.pixels.push_back(static_cast<std::uint8_t>(std::clamp(level(random), 0.0, 255.0)));
  EXPECT_FALSE(BoardFinder(chessboard(9, 6)).find(noise, /*flat=*/true));
  // Another board than the one that is looked for.
  const Target other = chessboard(8, 5);
  const Pose pose = turned(other.board, 0.3, 0.2, 0.0, 1.4);
  EXPECT_FALSE(
      BoardFinder(chessboard(9, 6))
          .find(render_board(BoardFinder(other).draw(64), other.board, pose, small_camera())));
}

TEST(FindBoard, PartsOfACharucoBoard) {
  const Target target = charuco(7, 5);
  const Camera camera = small_camera();
  Pose pose = turned(target.board, 0.3, 0.2, 0.1, 1.2);
  pose.t.x += 0.45;
  const auto view = BoardFinder(target).find(
      render_board(BoardFinder(target).draw(64), target.board, pose, camera));
  ASSERT_TRUE(view);
  EXPECT_LT(static_cast<int>(view->ids.size()), target.board.count());
  EXPECT_GE(view->ids.size(), 12u);
  EXPECT_LT(view_error(target.board, *view, camera, pose), 0.15);
}

TEST(FindBoard, DictionariesThatCannotBe) {
  Target target = charuco(7, 5);
  target.dictionary = "4X4_17";
  EXPECT_THROW(BoardFinder{target}, Error);
  target = charuco(15, 12);
  target.dictionary = "4X4_50";
  EXPECT_THROW(BoardFinder{target}, Error);
  target = charuco(7, 5);
  target.marker = 1.2;
  EXPECT_THROW(BoardFinder{target}, Error);
}

// Folders of rendered pictures, and the program.
class CalibrateTool : public testing::Test {
 protected:
  CalibrateTool() { fs::create_directories(folder_ / "take"); }

  // Pictures of two cameras beside each other; the truth. With a \p step the board is moved on by so
  // many of the others' steps from one to the next.
  std::vector<Camera> render(const Target& target, int count, bool mirror = false,
                             double step = 0.0) {
    Camera left = small_camera(), right = small_camera();
    left.name = "left";
    right.name = "right";
    right.R = from_parameters(std::array{0.02, 0.35, 0.01, 0.0, 0.0, 0.0}.data()).R;
    right.t = -(right.R * Vec3(0.5, 0.02, 0.05));
    const Picture drawing = BoardFinder(target).draw(64);
    for (const Camera& camera : {left, right}) {
      fs::create_directories(folder_ / "take" / camera.name);
      for (int i = 0; i < count; ++i) {
        const double s = step > 0.0 ? step * i : i;
        const Pose pose = turned(target.board, 0.55 * std::sin(1.9 * s), 0.5 * std::cos(2.7 * s),
                                 0.2 * std::sin(s), 1.3 + (step > 0.0 ? 0.0 : 0.04 * (i % 5)));
        const Vec3 beside = step > 0.0
                                ? Vec3(0.14 * std::sin(2.3 * s), 0.1 * std::cos(3.1 * s), 0.0)
                                : Vec3(0.12 * (i % 3 - 1), 0.07 * (i % 4 - 1.5), 0.0);
        const Pose moved{pose.R, pose.t + beside};
        Picture picture = render_board(drawing, target.board, moved, camera);
        if (mirror && camera.name == "right")
          for (int y = 0; y < picture.height; ++y)
            std::reverse(picture.row(y), picture.row(y) + picture.width);
        save_picture(picture,
                     (folder_ / "take" / camera.name / fmt::format("{:02}.png", i)).string());
      }
    }
    return {left, right};
  }

  int run(const std::string& arguments) {
    const std::string program =
        std::string(std::getenv("POLYHULL_BUILD")) + "/tools/polyhull-calibrate";
    const std::string out = folder_.file("out.txt");
    const int status = std::system(
        fmt::format("'{}' '{}' {} >'{}' 2>&1", program, folder_.file("take"), arguments, out)
            .c_str());
    text_ = read(out);
    return WEXITSTATUS(status);
  }

  static std::string read(const fs::path& path) {
    std::ifstream in(path);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }

  void expect_said(const std::string& words) const {
    EXPECT_NE(text_.find(words), std::string::npos) << words << " not in: " << text_;
  }

  const test::Folder folder_;
  std::string text_;
};

TEST_F(CalibrateTool, FromPicturesToRigAndReport) {
  const std::vector<Camera> truth = render(chessboard(7, 6), 12);
  const std::string rig = folder_.file("rig.json"), page = folder_.file("page.html");
  EXPECT_EQ(run("--board 7x6 --square 100 -o '" + rig + "' --report '" + page + "'"), 0) << text_;
  expect_said("finding the board in 24 pictures: 100 %");
  expect_said(": good");
  const Rig found = load_rig(rig);
  ASSERT_EQ(found.cameras.size(), 2u);
  EXPECT_EQ(found.unit, "m");
  for (const CameraError& error : errors_of(found.cameras, truth)) {
    EXPECT_LT(glm::length(error.centre), 1e-3);
    EXPECT_LT(std::abs(error.lens[0]), 1.5);
  }
  const std::string html = read(page);
  EXPECT_NE(html.find("data:image/jpeg;base64,"), std::string::npos);
  EXPECT_NE(html.find("id=\"scene\""), std::string::npos);
  EXPECT_EQ(html.find("http"), std::string::npos) << "needs something beside it";
  EXPECT_EQ(html.find("nan"), std::string::npos);

  // On the floor, with the lenses that were found, but not good enough for who asks.
  const std::string floor = folder_.file("floor.json");
  EXPECT_EQ(run("--quiet --board 7x6 --square 100 --max-rms 0.001 --floor-view 03 --lenses '" +
                rig + "' -o '" + floor + "'"),
            2);
  expect_said("not good: 'left'");
  EXPECT_EQ(load_rig(floor).cameras[1].K, found.cameras[1].K);
  EXPECT_EQ(load_rig(floor).up, Vec3(0.0, 1.0, 0.0));
  EXPECT_GT(load_rig(floor).cameras[0].centre().y, 0.5);
}

TEST_F(CalibrateTool, FromVideos) {
  // Each view stands still for half a second; what is between must not be looked at.
  const std::vector<Camera> truth = render(chessboard(7, 6), 12);
  fs::rename(folder_ / "take" / "left", folder_ / "left");
  const auto record = [&](const std::string& name, double rate) {
    cv::VideoWriter video((folder_ / "take" / (name + ".avi")).string(),
                          cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), rate, cv::Size(640, 480));
    for (int frame = 0; frame < 60; ++frame) {
      const fs::path file = folder_ / name / fmt::format("{:02}.png", frame / 5);
      Picture picture = load_picture(file.string(), 3);
      if (frame % 5 != 0) std::ranges::fill(picture.pixels, std::uint8_t{90});
      video.write(cv::Mat(480, 640, CV_8UC3, picture.pixels.data()));
    }
  };
  record("left", 10.0);
  EXPECT_EQ(run("--board 7x6 --square 100"), 1);
  expect_said("holds videos and the folder 'right'");
  fs::rename(folder_ / "take" / "right", folder_ / "right");
  record("right", 12.5);
  EXPECT_EQ(run("--board 7x6 --square 100"), 1);
  expect_said("right.avi' has 12.500 frames a second");
  record("right", 10.0);
  const std::string rig = folder_.file("rig.json");
  EXPECT_EQ(run("--every 0.5 --board 7x6 --square 100 --floor-view 000015 -o '" + rig + "'"), 0)
      << text_;
  expect_said("finding the board in 24 pictures: 100 %");
  const Rig found = load_rig(rig);
  ASSERT_EQ(found.cameras.size(), 2u);
  const double apart = glm::length(found.cameras[0].centre() - found.cameras[1].centre());
  EXPECT_NEAR(apart, glm::length(truth[0].centre() - truth[1].centre()), 2e-3);
  std::ofstream(folder_ / "take" / "right.avi") << "no video";
  EXPECT_EQ(run("--board 7x6 --square 100"), 1);
  expect_said("right.avi' cannot be read as a video");
}

// What the board contradicts by too few pixels to be refused.
TEST_F(CalibrateTool, FirstFramesThatAreMissing) {
  const std::vector<Camera> truth = render(chessboard(7, 6), 12, false, 0.02);
  fs::rename(folder_ / "take", folder_ / "boards");
  fs::create_directories(folder_ / "take");
  gst_init(nullptr, nullptr);
  for (const auto& [name, missing] : {std::pair{"left", 0}, {"right", 2}}) {
    GstElement* recorder = gst_parse_launch(
        fmt::format("multifilesrc location={}/%02d.png start-index={} stop-index=11 "
                    "caps=image/png,framerate=10/1 ! pngdec ! jpegenc quality=95 ! "
                    "identity name=last ! matroskamux ! filesink location={}.mkv",
                    (folder_ / "boards" / name).string(), missing,
                    (folder_ / "take" / name).string())
            .c_str(),
        nullptr);
    ASSERT_NE(recorder, nullptr);
    GstElement* last = gst_bin_get_by_name(GST_BIN(recorder), "last");
    GstPad* pad = gst_element_get_static_pad(last, "src");
    gst_pad_set_offset(pad, missing * GST_SECOND / 10);
    gst_element_set_state(recorder, GST_STATE_PLAYING);
    GstBus* bus = gst_element_get_bus(recorder);
    GstMessage* end = gst_bus_timed_pop_filtered(
        bus, 30 * GST_SECOND, static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
    EXPECT_TRUE(end != nullptr && GST_MESSAGE_TYPE(end) == GST_MESSAGE_EOS);
    if (end) gst_message_unref(end);
    gst_element_set_state(recorder, GST_STATE_NULL);
    gst_object_unref(bus);
    gst_object_unref(pad);
    gst_object_unref(last);
    gst_object_unref(recorder);
  }
  const std::string rig = folder_.file("rig.json");
  EXPECT_EQ(run("--quiet --every 0.1 --board 7x6 --square 100 -o '" + rig + "'"), 0) << text_;
  expect_said("right.mkv' lacks its first 2 frames");
  const Rig found = load_rig(rig);
  ASSERT_EQ(found.cameras.size(), 2u);
  const double apart = glm::length(found.cameras[0].centre() - found.cameras[1].centre());
  EXPECT_NEAR(apart, glm::length(truth[0].centre() - truth[1].centre()), 2e-3);
}

TEST_F(CalibrateTool, FromLiveCameras) {
  const std::vector<Camera> truth = render(chessboard(7, 6), 12);
  fs::rename(folder_ / "take", folder_ / "boards");
  // Sanitized code takes its time to find a board.
  const char* views_a_second = test::sanitized() ? "1/4" : "1/1";
  const auto camera = [&](const std::string& name) {
    return fmt::format(
        "--live '{}=multifilesrc location={}/%02d.png caps=image/png,framerate={} stop-index=11 ! "
        "pngdec ! videorate ! video/x-raw,framerate=20/1 ! identity sync=true' ",
        name, (folder_ / "boards" / name).string(), views_a_second);
  };
  const std::string rig = folder_.file("rig.json");
  const std::string shown = folder_.file("shown.jpg");
  // Views stand still for a second each and more; the cameras end before there is enough. A busy
  // machine misses some, which may leave too few to be called good.
  EXPECT_NE(run(camera("left") + camera("right") + "--every 0.2 --board 7x6 --square 100 -o '" +
                rig + "' --show 'jpegenc ! multifilesink location=" + shown + "'"),
            1)
      << text_;
  expect_said("left: 4 views");
  expect_said(" % covered, ");
  const Rig found = load_rig(rig);
  ASSERT_EQ(found.cameras.size(), 2u);
  const double apart = glm::length(found.cameras[0].centre() - found.cameras[1].centre());
  EXPECT_NEAR(apart, glm::length(truth[0].centre() - truth[1].centre()), 2e-3);
  const Picture guide = load_picture(shown, 3);
  EXPECT_EQ(guide.width, 1280);
  int green = 0;
  for (std::size_t i = 0; i < guide.pixels.size(); i += 3)
    green += guide.pixels[i + 1] > guide.pixels[i] + 20;
  EXPECT_GT(green, 20000) << "covered cells are not to be seen";

  EXPECT_EQ(run(camera("left") + "--board 7x6 --square 100"), 1);
  expect_said("is not empty");
  fs::remove_all(folder_ / "take");
  EXPECT_EQ(run("--live nothing --board 7x6 --square 100"), 1);
  expect_said("expected NAME=ELEMENTS");
  EXPECT_EQ(run("--show '' --live 'c=nosuchelement' --board 7x6 --square 100"), 1);
  expect_said("camera 'c' are not understood");
  fs::remove_all(folder_ / "take");
  EXPECT_EQ(run("--show '' --live 'c=filesrc location=/nowhere' --board 7x6 --square 100"), 1);
  expect_said("amera 'c' ");
}

TEST_F(CalibrateTool, Charuco) {
  const std::vector<Camera> truth = render(charuco(7, 5), 12);
  const std::string rig = folder_.file("rig.json");
  EXPECT_EQ(run("--quiet --board 7x5 --square 100 --marker 75 --charuco 4X4_100 -o '" + rig + "'"),
            0)
      << text_;
  for (const CameraError& error : errors_of(load_rig(rig).cameras, truth))
    EXPECT_LT(glm::length(error.centre), 2e-3);
}

TEST_F(CalibrateTool, MirroredCharucoIsNamed) {
  render(charuco(7, 5), 5, true);
  EXPECT_EQ(run("--quiet --board 7x5 --square 100 --charuco 4X4_100"), 1);
  expect_said("camera 'right' are mirrored");
}

TEST_F(CalibrateTool, BadInput) {
  EXPECT_EQ(run("--square 24"), 1);
  expect_said("has no sub-folders");
  const Picture grey{64, 48, 1, std::vector<std::uint8_t>(64 * 48, 120)};
  fs::create_directories(folder_ / "take" / "a");
  EXPECT_EQ(run("--square 24"), 1);
  expect_said("holds no PNG or JPEG");
  save_picture(grey, folder_.file("take/a/1.png"));
  EXPECT_EQ(run("--square 24"), 1);
  expect_said("none of the pictures of camera 'a'");
  EXPECT_EQ(run("--square 0"), 1);
  expect_said("squares have a side of 0");
  EXPECT_EQ(run("--square 24 --board 9by6"), 1);
  expect_said("expected COLUMNSxROWS");
  const Picture wide{80, 48, 1, std::vector<std::uint8_t>(80 * 48, 120)};
  save_picture(wide, folder_.file("take/a/2.png"));
  EXPECT_EQ(run("--square 24"), 1);
  expect_said("2.png' has 80x48 pixels");
  std::ofstream(folder_ / "take/a/3.png") << "not a picture";
  EXPECT_EQ(run("--square 24"), 1);
  expect_said("3.png");
  fs::remove(folder_ / "take/a/2.png");
  fs::remove(folder_ / "take/a/3.png");
  fs::create_directories(folder_ / "take" / "b");
  save_picture(grey, folder_.file("take/b/x.png"));
  EXPECT_EQ(run("--square 24"), 1);
  expect_said("has no number in its name");
}

// Said before the pictures, which show no board, are looked at.
TEST_F(CalibrateTool, WrongArgumentsAreSaidAtOnce) {
  const Picture grey{64, 48, 1, std::vector<std::uint8_t>(64 * 48, 120)};
  fs::create_directories(folder_ / "take" / "a");
  save_picture(grey, folder_.file("take/a/1.png"));
  const std::pair<const char*, const char*> wrong[] = {
      {"--floor-view 7", "there is no such instant. They are '1' to '1'"},
      {"--floor-points /no/where", "'/no/where'"},
      {"--lenses /no/where", "/no/where"},
      {"-o /no/where/rig.json", "There is no folder '/no/where'"},
      {"--report /no/where/page.html", "There is no folder '/no/where'"},
      {"--thickness nan", "--thickness is nan; 0 to 1000 mm"},
      {"--thickness -1", "--thickness is -1"}};
  for (const auto& [arguments, words] : wrong) {
    EXPECT_EQ(run(std::string("--square 24 ") + arguments), 1) << arguments;
    expect_said(words);
  }
  for (const char* square : {"nan", "-5", "1e30", "0.00001"}) {
    EXPECT_EQ(run(std::string("--square ") + square), 1);
    expect_said("0.1 mm to 10 m can be used");
  }
  fs::create_directories(folder_ / "take" / "caf\xe9");
  save_picture(grey, folder_.file("take/caf\xe9/1.png"));
  EXPECT_EQ(run("--square 24"), 1);
  expect_said("a name that is not UTF-8");
}

TEST_F(CalibrateTool, FloorPointsNameWhatIsWrong) {
  const Rig rig = default_rig();
  const auto refused = [&](const std::string& text) -> std::string {
    const std::string path = folder_.file("points.txt");
    std::ofstream(path) << text;
    return test::refusal_of([&] { read_floor_points(path, rig); });
  };
  EXPECT_NE(refused("a cam0 1").find("line 1: expected POINT CAMERA U V"), std::string::npos);
  EXPECT_NE(refused("# x\na nobody 1 2").find("line 2: there is no camera 'nobody'"),
            std::string::npos);
  EXPECT_NE(refused("a cam0 1 2 x").find("line 1: expected POINT CAMERA U V"), std::string::npos);
  EXPECT_NE(refused("a cam0 1 2 3").find("no camera 'cam0 1'"), std::string::npos);
  EXPECT_NE(refused("cam0 1 2").find("line 1: expected"), std::string::npos);
  EXPECT_NE(refused("acam0 cam 1 2").find("no camera 'cam'"), std::string::npos);
  EXPECT_NE(refused("a cam0 nan 2").find("line 1"), std::string::npos);
  EXPECT_NE(refused("a cam0 5 5\na cam1 9 9\nb cam0 1 2").find("point 'b'"), std::string::npos);
  EXPECT_NE(refused("a cam0 5 5\na cam0 5 5").find("point 'a'"), std::string::npos);
}

TEST_F(CalibrateTool, FloorPointsOfCamerasWithBlanks) {
  Rig rig = default_rig();
  for (std::size_t i = 0; i < rig.cameras.size(); ++i)
    rig.cameras[i].name = fmt::format("Stage Cam ({})", i + 1);
  rig.cameras[1].name = "Cam (1)";
  rig.cameras[2].name = "cam#3";
  std::string text = "# marks\r\n";
  const Vec3 marks[] = {{0.5, 0.0, 0.25}, {-0.5, 0.0, 0.25}};
  for (int m = 0; m < 2; ++m)
    for (int i = 0; i < 3; ++i) {
      const Vec2 p = *rig.cameras[i].project(marks[m]);
      text += fmt::format("mark {}\t{}  {:.17g} {:.17g} # seen well\r\n", m, rig.cameras[i].name,
                          p.x, p.y);
    }
  const std::string path = folder_.file("points.txt");
  std::ofstream(path) << text;
  const std::vector<Vec3> found = read_floor_points(path, rig);
  ASSERT_EQ(found.size(), 2u);
  for (int m = 0; m < 2; ++m) EXPECT_LT(glm::length(found[m] - marks[m]), 1e-9);
}

TEST_F(CalibrateTool, PicturesOfOneInstantShareNameOrNumber) {
  const Picture grey{8, 8, 1, std::vector<std::uint8_t>(64, 120)};
  for (const char* camera : {"left", "right"}) {
    fs::create_directories(folder_ / "take" / camera);
    for (const int i : {2, 10})
      save_picture(grey,
                   (folder_ / "take" / camera / fmt::format("{}{:04}.png", camera, i)).string());
  }
  calibrate_tool::Pictures pictures = calibrate_tool::list_pictures(folder_.file("take"));
  EXPECT_EQ(pictures.instants, (std::vector<std::string>{"2", "10"}));
  EXPECT_EQ(fs::path(pictures.files[1][1]).filename(), "right0010.png");
  save_picture(grey, folder_.file("take/left/a 7.png"));
  save_picture(grey, folder_.file("take/right/a 7.png"));
  pictures = calibrate_tool::list_pictures(folder_.file("take"));
  EXPECT_EQ(pictures.instants.size(), 5u);
}

}  // namespace
}  // namespace polyhull::calibration
