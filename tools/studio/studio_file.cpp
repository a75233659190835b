// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/studio_file.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string_view>

#include "base/error.h"
#include "base/parse_json.h"
#include "plugins/common/elements_in.h"
#include "studio/property_json.h"

namespace polyhull {
namespace {

using Json = nlohmann::ordered_json;

using element::elements_in;
using element::Ref;
using Elements = std::vector<Ref<GstElement>>;

std::string name_of(GstElement* element) {
  g_autofree gchar* name = gst_object_get_name(GST_OBJECT(element));
  return name;
}

std::string kind_of(GstElement* element) {
  const GstElementFactory* factory = gst_element_get_factory(element);
  return factory ? GST_OBJECT_NAME(factory) : "";
}

// The camera that a contourfind or silhouette makes views of.
std::optional<std::string> camera_of(GstElement* element) {
  const std::string kind = kind_of(element);
  if (kind != "contourfind" && kind != "silhouette") return std::nullopt;
  g_autofree gchar* camera = nullptr;
  g_object_get(element, "camera", &camera, nullptr);
  return camera ? std::optional<std::string>(camera) : std::nullopt;
}

// The element's pad that feeds \p sink, through any number of bins' pads; null where none does.
GstPad* feeding_pad(GstPad* sink) {
  GstPad* pad = gst_pad_get_peer(sink);
  while (pad && GST_IS_PROXY_PAD(pad)) {
    g_autoptr(GstPad) of_bin = pad;
    if (GST_IS_GHOST_PAD(of_bin)) {  // the way out of a bin
      pad = gst_ghost_pad_get_target(GST_GHOST_PAD(of_bin));
    } else {  // the way into one, seen from within
      g_autoptr(GstProxyPad) outside = gst_proxy_pad_get_internal(GST_PROXY_PAD(of_bin));
      pad = outside ? gst_pad_get_peer(GST_PAD(outside)) : nullptr;
    }
  }
  return pad;
}

// What is linked to \p element from upstream, itself and the bins around included: the camera's branch.
void add_branch(GstElement* element, std::set<GstElement*>& branch) {
  if (!branch.insert(element).second) return;
  for (GstObject* bin = GST_OBJECT_PARENT(element); bin && !GST_IS_PIPELINE(bin);
       bin = GST_OBJECT_PARENT(bin))
    branch.insert(GST_ELEMENT(bin));
  g_autoptr(GList) pads = nullptr;
  GST_OBJECT_LOCK(element);
  for (GList* pad = element->sinkpads; pad; pad = pad->next)
    pads = g_list_prepend(pads, gst_object_ref(pad->data));
  GST_OBJECT_UNLOCK(element);
  for (GList* item = pads; item; item = item->next) {
    g_autoptr(GstPad) pad = GST_PAD(item->data);
    g_autoptr(GstPad) feeding = feeding_pad(pad);
    g_autoptr(GstElement) parent = feeding ? gst_pad_get_parent_element(feeding) : nullptr;
    if (parent) add_branch(parent, branch);
  }
}

// Elements in the branches of \p camera.
std::set<GstElement*> branch_of(const Elements& elements, const std::string& camera) {
  std::set<GstElement*> branch;
  for (const Ref<GstElement>& element : elements)
    if (camera_of(element.get()) == camera) add_branch(element.get(), branch);
  return branch;
}

struct Property {
  element::Ref<GObject> owner;
  GParamSpec* spec = nullptr;  // null where there is none
};

// The element's, or as PAD::PROPERTY one of its pads' or children's.
Property property_of(GstElement* element, const std::string& name) {
  GObject* owner = nullptr;
  GParamSpec* spec = nullptr;
  if (GST_IS_CHILD_PROXY(element) && name.find("::") != name.npos) {
    if (!gst_child_proxy_lookup(GST_CHILD_PROXY(element), name.c_str(), &owner, &spec)) return {};
  } else {
    spec = g_object_class_find_property(G_OBJECT_GET_CLASS(element), name.c_str());
    owner = G_OBJECT(gst_object_ref(element));
  }
  return {element::Ref<GObject>(owner), spec};
}

// The values of \p entry as they now are, but for those that \p stronger (null: nothing) sets after it.
void update(GstElement* element, Json& entry, const Json* stronger,
            std::vector<std::string>& unsaid) {
  for (auto& [name, value] : entry.items()) {
    if (stronger && stronger->contains(name)) continue;
    const Property property = property_of(element, name);
    if (!property.spec || !is_setting(property.spec)) continue;
    if (const std::optional<Json> now = property_json(property.owner.get(), property.spec))
      value = *now;
    else
      unsaid.push_back(name_of(element) + "." + name);
  }
}

// Properties whose changes are not somebody's settings: old names of others, by which these are saved,
// and what sources change by themselves when they know their format.
bool is_not_of_people(GParamSpec* spec) {
  return std::string_view(spec->name) == "blocksize" || (spec->flags & G_PARAM_DEPRECATED);
}

// Objects of objects of properties' values.
void check_layout(const Json& part, const std::string& where, int depth) {
  if (!part.is_object())
    throw Error(Error::Kind::bad_input, "{}: must be an object, {{\"name\": …}}.", where);
  if (depth == 0) return;
  for (const auto& [key, value] : part.items()) check_layout(value, where + "." + key, depth - 1);
}

}  // namespace

StudioFile StudioFile::parse(const std::string& text, const std::string& source) {
  StudioFile studio;
  studio.source_ = source;
  studio.file_ = parse_json<Json>(text, source);
  const Json& file = studio.file_;
  if (!file.is_object() || file.value("format", Json()) != "polyhull-studio")
    throw Error(Error::Kind::bad_input,
                "{}: not a studio file: \"format\" must be \"polyhull-studio\".", source);
  if (file.value("version", Json()) != 1)
    throw Error(Error::Kind::bad_input, "{}: \"version\" is {}; this program reads version 1.",
                source, file.value("version", Json()).dump());
  if (file.contains("elements")) check_layout(file["elements"], source + ", elements", 1);
  if (file.contains("cameras")) check_layout(file["cameras"], source + ", cameras", 2);
  return studio;
}

void StudioFile::apply_to(GstElement* element, const std::string& where, const Json& properties,
                          Report& report) const {
  for (const auto& [name, value] : properties.items()) {
    const auto [owner, spec] = property_of(element, name);
    std::optional<std::string> problem;
    if (!spec)
      problem = fmt::format("{} has no such property", kind_of(element));
    else if (!is_setting(spec))
      problem = "cannot be set by a file";
    else
      problem = set_property_json(owner.get(), spec, value);
    if (!problem) continue;
    const std::string text = fmt::format("{}, {}.{}: {}.", source_, where, name, *problem);
    if (std::ranges::find(report.problems, text) == report.problems.end())
      report.problems.push_back(text);
  }
}

StudioFile::Report StudioFile::apply(GstBin* pipeline) {
  Report report;
  const Elements elements = elements_in(pipeline);
  for (const auto& [key, part] : file_.items()) {
    static const std::set<std::string> known{"format", "version", "description", "elements",
                                             "cameras"};
    if (!known.contains(key)) report.without_taker.push_back(fmt::format("{}, {}", source_, key));
  }
  // Cameras first: an element that is named, too, has its own way.
  const Json cameras = file_.value("cameras", Json::object());
  for (const auto& [camera, kinds] : cameras.items()) {
    const std::set<GstElement*> branch = branch_of(elements, camera);
    if (branch.empty()) {
      report.without_taker.push_back(fmt::format("{}, cameras.{}", source_, camera));
      continue;
    }
    for (const auto& [kind, properties] : kinds.items()) {
      const std::string where = "cameras." + camera + "." + kind;
      bool taken = false;
      for (const Ref<GstElement>& element : elements) {
        if (!branch.contains(element.get()) || kind_of(element.get()) != kind) continue;
        apply_to(element.get(), where, properties, report);
        taken = true;
      }
      if (!taken) report.without_taker.push_back(fmt::format("{}, {}", source_, where));
    }
  }
  const Json named = file_.value("elements", Json::object());
  for (const auto& [name, properties] : named.items()) {
    bool taken = false;
    for (const Ref<GstElement>& element : elements) {
      if (name_of(element.get()) != name) continue;
      apply_to(element.get(), "elements." + name, properties, report);
      taken = true;
    }
    if (!taken) report.without_taker.push_back(fmt::format("{}, elements.{}", source_, name));
  }
  for (const Ref<GstElement>& element : elements)
    applied_[name_of(element.get())] = settings_of(element.get());
  return report;
}

StudioFile::Settings StudioFile::settings_of(GstElement* element) {
  Settings settings;
  guint count = 0;
  g_autofree GParamSpec** specs =
      g_object_class_list_properties(G_OBJECT_GET_CLASS(element), &count);
  for (guint i = 0; i < count; ++i)
    if (is_setting(specs[i]) && !is_not_of_people(specs[i]))
      settings[specs[i]->name] = property_json(G_OBJECT(element), specs[i]);
  return settings;
}

std::vector<std::string> StudioFile::read_back(GstBin* pipeline) {
  std::vector<std::string> unsaid;
  const Elements elements = elements_in(pipeline);
  std::map<GstElement*, std::string> cameras;  // under which the file has the element's kind
  if (file_.contains("cameras")) {
    for (const auto& [camera, kinds] : file_["cameras"].items()) {
      const std::set<GstElement*> branch = branch_of(elements, camera);
      for (const Ref<GstElement>& element : elements)
        if (branch.contains(element.get()) && kinds.contains(kind_of(element.get())))
          cameras[element.get()] = camera;
    }
  }
  for (const Ref<GstElement>& element : elements) {
    const std::string name = name_of(element.get());
    // Looked up for each element: what the file gets moves what it has in memory.
    Json* by_camera = nullptr;
    if (const auto found = cameras.find(element.get()); found != cameras.end())
      by_camera = &file_["cameras"][found->second][kind_of(element.get())];
    Json* by_name = nullptr;
    if (file_.contains("elements") && file_["elements"].contains(name))
      by_name = &file_["elements"][name];
    if (by_camera) update(element.get(), *by_camera, by_name, unsaid);
    if (by_name) update(element.get(), *by_name, nullptr, unsaid);
    // Elements that came later, as a decodebin's, have only their own defaults to tell.
    const auto before = applied_.find(name);
    if (before == applied_.end()) continue;
    for (const auto& [property, value] : settings_of(element.get())) {
      if ((by_camera && by_camera->contains(property)) || (by_name && by_name->contains(property)))
        continue;
      const auto was = before->second.find(property);
      if (was == before->second.end() || was->second == value) continue;
      if (!value || !g_utf8_validate(name.c_str(), -1, nullptr)) {
        unsaid.push_back(name + "." + property);
        continue;
      }
      Json& entry = by_camera ? *by_camera : file_["elements"][name];
      entry[property] = *value;
    }
  }
  return unsaid;
}

std::string StudioFile::text() const {
  return file_.dump(2) + "\n";
}

}  // namespace polyhull
