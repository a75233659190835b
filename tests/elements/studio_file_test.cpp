// SPDX-License-Identifier: LGPL-2.1-or-later
// Studio files on pipelines: who takes what, what is refused, live changes taken back.
#include "studio/studio_file.h"

#include <algorithm>

#include "base/error.h"
#include "element_test.h"

namespace {

using polyhull::StudioFile;
using Json = nlohmann::ordered_json;

GstBin* pipeline_of_two() {
  g_autoptr(GError) error = nullptr;
  GstElement* pipeline = gst_parse_launch(
      "videotestsrc name=left ! chromamatte name=key ! gaussblur name=blur ! contourfind "
      "camera=cam0 ! hull. "
      "videotestsrc name=right ! silhouette camera=cam1 ! hull. hullbuild name=hull ! fakesink",
      &error);
  fail_unless(pipeline && !error, "%s", error ? error->message : "");
  return GST_BIN(pipeline);
}

StudioFile studio(const std::string& parts) {
  return StudioFile::parse(R"({"format":"polyhull-studio","version":1,)" + parts + "}",
                           "test.json");
}

Json of_text(const StudioFile& file) {
  return Json::parse(file.text());
}

Json element_value(GstBin* pipeline, const char* name, const char* property) {
  g_autoptr(GstElement) element = gst_bin_get_by_name(pipeline, name);
  g_auto(GValue) value = G_VALUE_INIT;
  g_object_get_property(G_OBJECT(element), property, &value);
  if (G_VALUE_HOLDS_DOUBLE(&value)) return g_value_get_double(&value);
  g_autofree gchar* text = gst_value_serialize(&value);
  return text;
}

void expect_one(const std::vector<std::string>& found, const char* text) {
  fail_unless(found.size() == 1 && found[0] == text, "%zu, first: %s", found.size(),
              found.empty() ? "" : found[0].c_str());
}

}  // namespace

ELEMENT_TEST(test_by_name_and_by_camera) {
  GstBin* pipeline = pipeline_of_two();
  StudioFile file = studio(R"("elements": {"key": {"strength": 75}, "left": {"pattern": "blue"},
      "hull": {"sink_0::camera": "cam0", "max-wait": 1234}},
    "cameras": {"cam0": {"chromamatte": {"strength": 50, "spill": 0.25}, "gaussblur": {"sigma": 2}},
                "cam1": {"videotestsrc": {"pattern": "ball"}, "silhouette": {"tolerance": 0.7}}})");
  const auto report = file.apply(pipeline);
  fail_unless(report.problems.empty(), "%s",
              report.problems.empty() ? "" : report.problems[0].c_str());
  fail_unless(report.without_taker.empty());
  fail_unless(element_value(pipeline, "key", "strength") == "75");  // by name comes last
  fail_unless(element_value(pipeline, "key", "spill") == 0.25);
  fail_unless(element_value(pipeline, "left", "pattern") == "blue");
  fail_unless(element_value(pipeline, "right", "pattern") == "ball");  // cam1's own source only
  const Json before = of_text(file);
  file.read_back(pipeline);
  fail_unless(of_text(file) == before, "%s", file.text().c_str());
  gst_object_unref(pipeline);
}

ELEMENT_TEST(test_what_has_no_taker) {
  GstBin* pipeline = pipeline_of_two();
  expect_one(studio(R"("elements": {"nobody": {"a": 1}})").apply(pipeline).without_taker,
             "test.json, elements.nobody");
  expect_one(studio(R"("cameras": {"cam9": {}})").apply(pipeline).without_taker,
             "test.json, cameras.cam9");
  expect_one(studio(R"("cameras": {"cam1": {"chromamatte": {}}})").apply(pipeline).without_taker,
             "test.json, cameras.cam1.chromamatte");
  expect_one(studio(R"("lights": {})").apply(pipeline).without_taker, "test.json, lights");
  gst_object_unref(pipeline);
}

ELEMENT_TEST(test_wrong_values_are_named_and_left_out) {
  const std::pair<const char*, const char*> wrong[] = {
      {R"("sigma": true)", "test.json, elements.blur.sigma: is true; expected a number from 0 to "},
      {R"("sigma": -1)", "sigma: is -1; expected a number from 0 to "},
      {R"("passes": 1.5)", "passes: is 1.5; expected a whole number from "},
      {R"("passes": 99999999999999999999)", "passes: is "},
      {R"("method": "square")", "method: is \"square\"; expected one of "},
      {R"("qos": 1)", "qos: is 1; expected true or false"},
      {R"("sigmaa": 1)", "sigmaa: gaussblur has no such property"},
      {R"("stats": "x")", "stats: cannot be set by a file"},
      {R"("name": "x")", "name: cannot be set by a file"},
  };
  for (const auto& [property, message] : wrong) {
    GstBin* pipeline = pipeline_of_two();
    const auto report =
        studio(std::string(R"("elements": {"blur": {)") + property + "}}").apply(pipeline);
    fail_unless(report.problems.size() == 1, "%s", property);
    fail_unless(report.problems[0].find(message) != std::string::npos, "%s",
                report.problems[0].c_str());
    gst_object_unref(pipeline);
  }
}

ELEMENT_TEST(test_live_changes_come_back) {
  GstBin* pipeline = pipeline_of_two();
  StudioFile file = studio(R"("description": "stage 2", "elements": {"gone": {"x": [1]}},
    "cameras": {"cam0": {"chromamatte": {"strength": 50}}, "cam9": {"silhouette": {"sigma": 3}}})");
  file.apply(pipeline);
  g_autoptr(GstElement) key = gst_bin_get_by_name(pipeline, "key");
  g_autoptr(GstElement) hull = gst_bin_get_by_name(pipeline, "hull");
  g_object_set(key, "strength", 60, "spill", 1.0 / 3.0, "outside-polygon", "0,0 9,0 9,9", nullptr);
  gst_util_set_object_arg(G_OBJECT(hull), "missing-camera", "hold");
  file.read_back(pipeline);
  const Json expected = Json::parse(R"({"format":"polyhull-studio","version":1,
    "description": "stage 2",
    "elements": {"gone": {"x": [1]}, "hull": {"missing-camera": "hold"}},
    "cameras": {"cam0": {"chromamatte": {"strength": 60, "outside-polygon": "0,0 9,0 9,9",
                                         "spill": 0.3333333333333333}},
                "cam9": {"silhouette": {"sigma": 3}}}})");
  fail_unless(nlohmann::json(of_text(file)) == nlohmann::json(expected), "%s", file.text().c_str());
  // What was saved sets a new pipeline the same way.
  GstBin* again = pipeline_of_two();
  fail_unless(StudioFile::parse(file.text(), "again").apply(again).problems.empty());
  fail_unless(element_value(again, "key", "spill") == 1.0 / 3.0);
  gst_object_unref(again);
  gst_object_unref(pipeline);
}

// A file that has cameras only gets elements while its cameras are read back.
ELEMENT_TEST(test_changes_of_cameras_and_others_together) {
  GstBin* pipeline = pipeline_of_two();
  StudioFile file = studio(R"("cameras": {"cam0": {"chromamatte": {"strength": 50}},
                                          "cam1": {"silhouette": {"tolerance": 0.5}}})");
  file.apply(pipeline);
  for (const char* name : {"hull", "blur", "right", "key"}) {
    g_autoptr(GstElement) element = gst_bin_get_by_name(pipeline, name);
    if (g_str_equal(name, "hull")) g_object_set(element, "min-cameras", 2, nullptr);
    if (g_str_equal(name, "blur")) g_object_set(element, "sigma", 3.0, nullptr);
    if (g_str_equal(name, "right")) gst_util_set_object_arg(G_OBJECT(element), "pattern", "ball");
    if (g_str_equal(name, "key")) g_object_set(element, "strength", 60, nullptr);
  }
  fail_unless(file.read_back(pipeline).empty());
  const Json saved = of_text(file);
  fail_unless(saved["cameras"]["cam0"]["chromamatte"]["strength"] == 60, "%s", file.text().c_str());
  fail_unless(saved["elements"]["hull"]["min-cameras"] == 2, "%s", file.text().c_str());
  fail_unless(saved["elements"]["blur"]["sigma"] == 3.0, "%s", file.text().c_str());
  fail_unless(saved["elements"]["right"]["pattern"] == "ball", "%s", file.text().c_str());
  gst_object_unref(pipeline);
}

ELEMENT_TEST(test_what_json_cannot_hold_is_left_out) {
  g_autoptr(GError) error = nullptr;
  GstBin* pipeline =
      GST_BIN(gst_parse_launch("filesrc name=a ! fakesink filesrc name=b ! fakesink", &error));
  fail_unless(!error);
  StudioFile file = studio(R"("elements": {"a": {"location": "plain"}})");
  file.apply(pipeline);
  for (const char* name : {"a", "b"}) {
    g_autoptr(GstElement) element = gst_bin_get_by_name(pipeline, name);
    g_object_set(element, "location", "caf\xe9.y4m", nullptr);  // Latin-1
  }
  const auto unsaid = file.read_back(pipeline);
  fail_unless_equals_int(unsaid.size(), 2);
  fail_unless(std::ranges::count(unsaid, "a.location") == 1);
  fail_unless(std::ranges::count(unsaid, "b.location") == 1);
  fail_unless(of_text(file)["elements"] == Json::parse(R"({"a": {"location": "plain"}})"));
  gst_object_unref(pipeline);
}

ELEMENT_TEST(test_elements_that_came_later) {
  GstBin* pipeline = pipeline_of_two();
  StudioFile file = studio(R"("elements": {})");
  file.apply(pipeline);
  // One of a new name, and another kind of a name that there was.
  gst_bin_add(pipeline, gst_element_factory_make("queue", "late"));
  g_autoptr(GstElement) blur = gst_bin_get_by_name(pipeline, "blur");
  gst_bin_remove(pipeline, blur);
  gst_bin_add(pipeline, gst_element_factory_make("queue", "blur"));
  const Json before = of_text(file);
  file.read_back(pipeline);
  fail_unless(of_text(file) == before, "%s", file.text().c_str());
  gst_object_unref(pipeline);
}

ELEMENT_TEST(test_branches_go_through_bins) {
  g_autoptr(GError) error = nullptr;
  GstBin* pipeline = GST_BIN(gst_parse_launch(
      "( name=outer ( name=source videotestsrc name=left ! identity ) ! queue name=waits ) ! "
      "( chromamatte name=key ! gaussblur ) ! ( contourfind camera=cam0 ) ! fakesink "
      "videotestsrc name=right ! fakesink",
      &error));
  fail_unless(!error, "%s", error ? error->message : "");
  StudioFile file = studio(R"("cameras": {"cam0": {"videotestsrc": {"pattern": "ball"},
      "queue": {"max-size-buffers": 3}, "chromamatte": {"strength": 75},
      "bin": {"message-forward": true}}})");
  const auto report = file.apply(pipeline);
  fail_unless(report.without_taker.empty(), "%s",
              report.without_taker.empty() ? "" : report.without_taker[0].c_str());
  fail_unless(element_value(pipeline, "left", "pattern") == "ball");
  fail_unless(element_value(pipeline, "right", "pattern") == "smpte");
  fail_unless(element_value(pipeline, "waits", "max-size-buffers") == "3");
  fail_unless(element_value(pipeline, "key", "strength") == "75");
  gst_object_unref(pipeline);
}

ELEMENT_TEST(test_what_is_no_studio_file) {
  const std::pair<std::string, const char*> wrong[] = {
      {"{", "test.json: not JSON at line 1, column 2: "},
      {"[]", "\"format\" must be \"polyhull-studio\""},
      {"{}", "\"format\" must be"},
      {R"({"format":"polyhull-rig","version":1})", "\"format\" must be"},
      {R"({"format":"polyhull-studio"})", "\"version\" is null"},
      {R"({"format":"polyhull-studio","version":2})",
       "\"version\" is 2; this program reads version 1"},
      {R"({"format":"polyhull-studio","version":1,"elements":[]})",
       "test.json, elements: must be an object"},
      {R"({"format":"polyhull-studio","version":1,"elements":{"a":1}})",
       "elements.a: must be an object"},
      {R"({"format":"polyhull-studio","version":1,"cameras":{"a":{"b":null}}})",
       "cameras.a.b: must be"},
      {std::string(60, '['), "not JSON"},
      {std::string(1000000, '['), "test.json: more than 64 brackets within each other"},
      {R"({"format":"polyhull-studio","version":)" + std::string(1000000, '[') +
           std::string(1000000, ']') + "}",
       "more than 64 brackets"},
      {"{\"format\":\"\xe9\"}", "not JSON"},
  };
  for (const auto& [text, part] : wrong) {
    std::string message = "no error";
    try {
      StudioFile::parse(text, "test.json");
    } catch (const polyhull::Error& error) {
      message = error.what();
    }
    fail_unless(message.find(part) != std::string::npos, "%s: %s", text.substr(0, 80).c_str(),
                message.c_str());
  }
}
