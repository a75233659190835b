// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/animation/gltf_animations.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "gltf/instances.h"

namespace polyhull {
namespace {

// Of all tracks: some 400 MB. Channels of a small file may all have the same keys.
constexpr std::size_t most_values = 10'000'000;

class AnimationReader {
 public:
  AnimationReader(const GltfSource& source, const std::multimap<int, int>& places,
                  std::set<std::string>& left_out)
      : source_(source), places_(places), left_out_(left_out) {}

  Animation read(const tinygltf::Animation& in, std::size_t number) {
    Animation out;
    out.name = in.name;
    std::map<int, NodeMotion> motions;
    for (std::size_t c = 0; c < in.channels.size(); ++c) {
      const tinygltf::AnimationChannel& channel = in.channels[c];
      const std::optional<AnimationTrack::Part> part = part_of(channel.target_path);
      // glTF says of channels without a node that they are to be passed over.
      if (channel.target_node < 0 && channel.target_path != "pointer") continue;
      if (!part) {
        left_out_.insert(channel.target_path == "weights"
                             ? "animated morphs"
                             : "animations of anything but translation, rotation and scale");
        continue;
      }
      const auto [first, last] = places_.equal_range(channel.target_node);
      if (first == last) continue;
      words_ = fmt::format("animation {} '{}' whose channel {} (node '{}')", number + 1, in.name, c,
                           source_.model.nodes[channel.target_node].name);
      const AnimationTrack track = read_track(in, channel, *part);
      charge(track.values.size() * static_cast<std::size_t>(std::distance(first, last)));
      out.duration = std::max(out.duration, track.times.back());
      for (auto place = first; place != last; ++place) {
        NodeMotion& motion = motions[place->second];
        motion.node = place->second;
        motion.rest = transform_parts(source_.model.nodes[channel.target_node]);
        motion.tracks.push_back(track);
      }
    }
    for (auto& [node, motion] : motions) out.motions.push_back(std::move(motion));
    return out;
  }

 private:
  static std::optional<AnimationTrack::Part> part_of(const std::string& path) {
    if (path == "translation") return AnimationTrack::Part::translation;
    if (path == "rotation") return AnimationTrack::Part::rotation;
    if (path == "scale") return AnimationTrack::Part::scale;
    return {};
  }

  Error broken(const std::string& why) const {
    return broken_scene(source_.path, fmt::format("has an {} {}.", words_, why));
  }

  AnimationTrack::Interpolation interpolation_of(const std::string& name) const {
    if (name.empty() || name == "LINEAR") return AnimationTrack::Interpolation::linear;
    if (name == "STEP") return AnimationTrack::Interpolation::step;
    if (name == "CUBICSPLINE") return AnimationTrack::Interpolation::cubic;
    throw broken(
        fmt::format("is interpolated by '{}'; expected LINEAR, STEP or CUBICSPLINE", name));
  }

  AnimationTrack read_track(const tinygltf::Animation& in,
                            const tinygltf::AnimationChannel& channel, AnimationTrack::Part part) {
    if (channel.sampler < 0 || static_cast<std::size_t>(channel.sampler) >= in.samplers.size())
      throw broken("has no sampler");
    const tinygltf::AnimationSampler& sampler = in.samplers[channel.sampler];
    AnimationTrack track;
    track.part = part;
    track.interpolation = interpolation_of(sampler.interpolation);
    const std::string of = " of the " + words_;
    const std::vector<float> times = read_floats(source_, sampler.input, 1, "key times" + of);
    track.times.assign(times.begin(), times.end());
    check_times(track.times);
    const std::size_t components = part == AnimationTrack::Part::rotation ? 4 : 3;
    const std::vector<float> values =
        read_floats(source_, sampler.output, components, "key values" + of);
    const bool cubic = track.interpolation == AnimationTrack::Interpolation::cubic;
    const std::size_t wanted = (cubic ? 3 : 1) * times.size();
    if (values.size() != wanted * components)
      throw broken(fmt::format("has {} keys but {} values; expected {}", times.size(),
                               values.size() / components, wanted));
    for (std::size_t i = 0; i < wanted; ++i) {
      Vec4 value(0.0);
      for (std::size_t k = 0; k < components; ++k)
        value[static_cast<int>(k)] = values[i * components + k];
      if (!std::isfinite(value.x + value.y + value.z + value.w))
        throw broken(fmt::format("has a value {} that is not finite (NaN or infinite)", i));
      track.values.push_back(value);
    }
    return track;
  }

  void check_times(const std::vector<double>& times) const {
    if (times.empty()) throw broken("has no keys");
    for (std::size_t i = 0; i < times.size(); ++i) {
      if (!std::isfinite(times[i]))
        throw broken(fmt::format("has a key {} at a time that is not finite (NaN or infinite)", i));
      if (i > 0 && times[i] < times[i - 1])
        throw broken(fmt::format(
            "has keys that are not in the order of their times: key {} at {} s follows one at {} s",
            i, times[i], times[i - 1]));
    }
  }

  void charge(std::size_t values) {
    values_ += values;
    if (values_ > most_values)
      throw Error(Error::Kind::unsupported,
                  "Scene '{}' is too large: its animations have more than {} key values (those "
                  "of a node in each place that it hangs in). Export fewer keys, or fewer "
                  "animations.",
                  source_.path, most_values);
  }

  const GltfSource& source_;
  const std::multimap<int, int>& places_;
  std::set<std::string>& left_out_;
  std::string words_;  // which channel it is
  std::size_t values_ = 0;
};

}  // namespace

std::vector<Animation> read_animations(const GltfSource& source,
                                       const std::multimap<int, int>& places,
                                       std::set<std::string>& left_out) {
  AnimationReader reader(source, places, left_out);
  std::vector<Animation> out;
  for (const tinygltf::Animation& animation : source.model.animations)
    out.push_back(reader.read(animation, out.size()));
  return out;
}

}  // namespace polyhull
