// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Animations added to scenes that save_scene() wrote.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace polyhull::test {

/// What an animation does to a node: `values` are those of all keys, one after the other.
struct Channel {
  std::string node, path;
  std::vector<float> times, values;
  std::string interpolation = "LINEAR";
};

/// The JSON of the GLB file at \p path, changed by \p change.
template <class Change>
void change_json(const std::string& path, const Change& change) {
  std::ifstream in(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  in.close();
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 12, sizeof length);
  nlohmann::json root = nlohmann::json::parse(bytes.substr(20, length));
  change(root);
  std::string text = root.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::string rest = bytes.substr(20 + length);
  const std::uint32_t head[] = {0x46546c67u, 2u,
                                static_cast<std::uint32_t>(20 + text.size() + rest.size()),
                                static_cast<std::uint32_t>(text.size()), 0x4e4f534au};
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(head), sizeof head);
  out << text << rest;
}

/// Adds the animation \p name to the GLB file at \p path; its keys lie in a file beside it.
inline void add_animation(const std::string& path, const std::string& name,
                          const std::vector<Channel>& channels) {
  change_json(path, [&](nlohmann::json& root) {
    using nlohmann::json;
    const std::string keys = path + "." + std::to_string(root.value("animations", json()).size());
    std::ofstream file(keys, std::ios::binary);
    std::size_t offset = 0;
    const std::size_t buffer = root["buffers"].size();
    const auto add = [&](const std::vector<float>& numbers, std::size_t components) {
      const std::size_t size = numbers.size() * sizeof(float);
      file.write(reinterpret_cast<const char*>(numbers.data()), static_cast<std::streamsize>(size));
      root["bufferViews"].push_back(
          {{"buffer", buffer}, {"byteOffset", offset}, {"byteLength", size}});
      offset += size;
      root["accessors"].push_back(
          {{"bufferView", root["bufferViews"].size() - 1},
           {"componentType", 5126},
           {"count", numbers.size() / components},
           {"type", components == 1 ? "SCALAR" : "VEC" + std::to_string(components)}});
      return root["accessors"].size() - 1;
    };
    json animation = {{"name", name}, {"channels", json::array()}, {"samplers", json::array()}};
    for (const Channel& channel : channels) {
      const std::size_t components = channel.path == "rotation"  ? 4
                                     : channel.path == "weights" ? 1
                                                                 : 3;
      const std::size_t input = add(channel.times, 1), output = add(channel.values, components);
      std::size_t node = 0;
      while (root["nodes"][node].value("name", "") != channel.node) ++node;
      animation["channels"].push_back({{"sampler", animation["samplers"].size()},
                                       {"target", {{"node", node}, {"path", channel.path}}}});
      animation["samplers"].push_back(
          {{"input", input}, {"output", output}, {"interpolation", channel.interpolation}});
    }
    root["animations"].push_back(animation);
    root["buffers"].push_back(
        {{"uri", std::filesystem::path(keys).filename().string()}, {"byteLength", offset}});
  });
}

}  // namespace polyhull::test
