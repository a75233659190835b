// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/takesink/takesink_settings.h"

#include <filesystem>

#include "base/error.h"
#include "take/take_reader.h"

namespace polyhull::element {
namespace {

std::string read_text(const char* what, const std::string& path) {
  if (path.empty()) return {};
  g_autofree char* text = nullptr;
  gsize size = 0;
  g_autoptr(GError) error = nullptr;
  if (!g_file_get_contents(path.c_str(), &text, &size, &error))
    throw Error(Error::Kind::not_found, "The file for {}, '{}', cannot be kept in the take: {}.",
                what, path, error->message);
  return {text, size};
}

/// What is there was seen by the cameras of the rig that is there.
void check_rig(const std::string& location, const std::string& rig) {
  if (!std::filesystem::exists(location)) return;
  for (const TakeNote& note : read_take(location).notes)
    if (note.name == "rig" && note.value != rig)
      throw Error(
          Error::Kind::bad_input,
          "The take '{}' keeps another rig than the one that is to be kept in it, by which what is "
          "in it was recorded. Write another take, or leave rig unset if the cameras are the same.",
          location);
}

}  // namespace

template <>
GType enum_type<TakeWriter::Existing>() {
  using Existing = TakeWriter::Existing;
  return register_enum<Existing>(
      "PolyhullExistingTake", {{Existing::refuse, "End with an error", "refuse"},
                               {Existing::append, "Put what comes behind what is there", "append"},
                               {Existing::replace, "Delete the take that is there", "replace"}});
}

template <>
GType enum_type<Packing>() {
  return register_enum<Packing>(
      "PolyhullTakeCompression",
      {{Packing::none, "As it comes", "none"},
       {Packing::exact, "Smaller; what is played is the same byte by byte", "exact"},
       {Packing::lossy, "Far smaller; colours, mattes and vertices have an error", "lossy"}});
}

std::span<const Property<TakeSinkSettings>> takesink_properties() {
  using S = TakeSinkSettings;
  static const Property<S> table[] = {
      property<&S::location>("location", "The take to write, one file.", 0, 0, Change::when_ready),
      property<&S::existing>(
          "existing",
          "What is done where there is a take of this name already. Any other file is refused.", 0,
          0, Change::when_ready),
      property<&S::rig>("rig",
                        "Rig file whose content is kept in the take, so that it goes where the "
                        "take goes. Unset: none.",
                        0, 0, Change::when_ready),
      property<&S::settings>("settings",
                             "Studio file whose content is kept in the take. Unset: none.", 0, 0,
                             Change::when_ready),
      property<&S::compression>("compression",
                                "How buffers are made smaller by what the ones before told. What "
                                "'lossy' loses is set by precision and quantizer."),
      property<&S::key_interval>(
          "key-interval",
          "With compression: buffers of a stream from one that stands alone to the next (1 to "
          "250), fewer where they are large. A seek unpacks no more than these; a damaged one "
          "takes those up to the next with it.",
          1, longest_key_interval),
      property<&S::precision>("precision",
                              "With compression=lossy: how far a mesh's vertex may move, in "
                              "millimetres (0 to 100). 0: not at all.",
                              0, 100),
      property<&S::quantizer>(
          "quantizer",
          "With compression=lossy: VP8's, of the pictures (0, the best, to 63, the smallest).", 0,
          63),
  };
  return table;
}

PackingSettings packing_of(const TakeSinkSettings& settings) {
  return {settings.compression, settings.key_interval, settings.precision, settings.quantizer};
}

TakeTexts read_texts(const TakeSinkSettings& settings) {
  TakeTexts texts;
  texts.rig = read_text("rig", settings.rig);
  if (settings.existing == TakeWriter::Existing::append && !settings.rig.empty())
    check_rig(settings.location, texts.rig);
  texts.settings = read_text("settings", settings.settings);
  return texts;
}

}  // namespace polyhull::element
