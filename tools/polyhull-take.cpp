// SPDX-License-Identifier: LGPL-2.1-or-later
// Looks into takes that takesink wrote: what is in them, the texts that they keep, their meshes as
// files, and what is whole of a damaged one.
#include <cstdio>
#include <deque>
#include <filesystem>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/stopwatch.h"
#include "command_line.h"
#include "files/glb_animation.h"
#include "files/mesh_files.h"
#include "files/numbered_name.h"
#include "take/take_reader.h"
#include "take/take_writer.h"
#include "text_file.h"
#include "wire/coded_view.h"
#include "wire/mesh_payload.h"

namespace {

using namespace polyhull;

constexpr char view_caps[] = "application/x-polyhull-view";
constexpr char mesh_caps[] = "application/x-polyhull-mesh";

double seconds(std::int64_t time) {
  return 1e-9 * static_cast<double>(time);
}

/// As an animation tells it.
float seconds_apart(std::int64_t begin, std::int64_t time) {
  return static_cast<float>(seconds(time - begin));
}

/// What the first packet of a stream says.
std::string describe(const TakePacket& packet) {
  if (packet.caps.starts_with(view_caps)) {
    const Bytes bytes(packet.data);
    const CodedView coded = read_coded_view({&bytes, 1});
    return "view of " + coded.view.camera + (coded.coding == PixelCoding::raw ? "" : ", packed");
  }
  if (packet.caps.starts_with(mesh_caps)) return "mesh";
  return packet.caps.substr(0, packet.caps.find(','));
}

int info(const std::string& path) {
  const TakeContent content = read_take(path);
  std::printf("%-10s %-28s %10s %10s %10s %12s\n", "stream", "what", "from s", "to s", "buffers",
              "bytes");
  bool whole = true;
  for (const TakeStream& stream : content.streams) {
    TakeCursor cursor(path, stream.id);
    std::string what = "nothing";
    std::uint64_t buffers = 0, bytes = 0, announcements = 0;
    std::int64_t event = 0;
    while (const auto packet = cursor.next()) {
      if (buffers++ == 0) {
        try {
          what = describe(*packet);
        } catch (const Error&) {
          what = "unreadable";
        }
      }
      bytes += packet->data.size();
      if (std::exchange(event, packet->event) != packet->event) ++announcements;
    }
    std::printf("%-10s %-28s %10.3f %10.3f %10llu %12llu", stream.name.c_str(), what.c_str(),
                seconds(stream.begin), seconds(stream.end),
                static_cast<unsigned long long>(buffers), static_cast<unsigned long long>(bytes));
    if (announcements > 0)
      std::printf("  %llu announcements", static_cast<unsigned long long>(announcements));
    if (cursor.damaged() > 0)
      std::printf("  %llu damaged", static_cast<unsigned long long>(cursor.damaged()));
    std::printf("\n");
    whole = whole && cursor.damaged() == 0;
  }
  for (const TakeNote& note : content.notes)
    std::printf("%-10s text, %zu bytes: polyhull-take extract %s %s\n", note.name.c_str(),
                note.value.size(), path.c_str(), note.name.c_str());
  return whole ? 0 : 1;
}

int extract(const std::string& path, const std::string& name, const std::string& output) {
  std::string known;
  for (const TakeNote& note : read_take(path).notes) {
    if (note.name == name) {
      if (output.empty()) {
        std::fputs(note.value.c_str(), stdout);
      } else {
        write_text(note.value, output);
      }
      return 0;
    }
    known += (known.empty() ? "" : ", ") + note.name;
  }
  throw Error(Error::Kind::not_found, "The take '{}' keeps no text '{}'. It keeps {}.", path, name,
              known.empty() ? "none" : known);
}

struct Export {
  std::string output, stream;
  double from = 0, to = 1e9;
  unsigned every = 1;
  int quality = 90;
};

/// The stream of that name, or the only one that holds meshes.
TakeStream mesh_stream(const std::string& path, const std::string& name) {
  std::vector<TakeStream> found;
  std::string all;
  for (const TakeStream& stream : read_take(path).streams) {
    all += (all.empty() ? "" : ", ") + stream.name;
    if (!name.empty() && stream.name != name) continue;
    const auto first = TakeCursor(path, stream.id).next();
    if (first && first->caps.starts_with(mesh_caps)) found.push_back(stream);
  }
  if (found.empty())
    throw Error(
        Error::Kind::bad_input,
        "There are no meshes in {} of '{}'. Record behind hulltexture, or make them from the "
        "views: takesrc ! hullbuild ! hulltexture ! takesink.",
        name.empty() ? "any stream (" + all + ")" : "the stream " + name, path);
  if (found.size() > 1)
    throw Error(Error::Kind::bad_input,
                "Several streams of '{}' hold meshes; name one with --stream: {}.", path, all);
  return found.front();
}

/// Says on standard error that \p count of \p what (with its verb) were left out, if any were.
void print_left_out(std::uint64_t count, const char* what) {
  if (count > 0)
    std::fprintf(stderr, "%llu %s and were left out\n", static_cast<unsigned long long>(count),
                 what);
}

int write_meshes(const std::string& path, const Export& options) {
  const NumberedName name(options.output);
  const bool animated = !name.numbered();
  if (animated ? !options.output.ends_with(".glb") : !is_mesh_file_name(name.name(0)))
    throw Error(Error::Kind::bad_input,
                "'{}' is neither one animated .glb nor a numbered sequence such as hull-%05d.glb "
                "({}).",
                options.output, mesh_file_endings());
  const MeshFileOptions file_options{true, true, options.quality};
  const TakeStream stream = mesh_stream(path, options.stream);
  TakeCursor cursor(path, stream.id);
  cursor.seek(static_cast<std::int64_t>(1e9 * options.from));
  GlbAnimation animation(file_options);
  std::uint64_t meshes = 0, written = 0, unreadable = 0, together = 0, bytes = 0;
  std::optional<std::int64_t> begin, last;
  const Stopwatch taken;
  while (const auto packet = cursor.next()) {
    if (seconds(packet->time) >= options.to) break;
    if (meshes++ % options.every != 0) continue;
    Mesh mesh;
    try {
      mesh = read_mesh(Bytes(packet->data));
    } catch (const Error& error) {
      if (unreadable++ == 0)
        std::fprintf(stderr, "What is at %.3f s of the stream %s is left out: %s\n",
                     seconds(packet->time), stream.name.c_str(), error.what());
      continue;
    }
    if (!begin) begin = packet->time;
    if (animated && last && seconds_apart(*begin, *last) == seconds_apart(*begin, packet->time)) {
      ++together;
      continue;
    }
    last = packet->time;
    if (animated) {
      animation.add(mesh, seconds(packet->time - *begin));
    } else {
      write_mesh_file(mesh, name.name(written), file_options);
      bytes += std::filesystem::file_size(name.name(written));
    }
    ++written;
  }
  if (written == 0)
    throw Error(Error::Kind::bad_input, "There is no mesh from {} to {} s in '{}', which has {} s.",
                options.from, options.to, path, seconds(stream.end));
  if (animated) {
    animation.write(options.output);
    bytes = std::filesystem::file_size(options.output);
  }
  std::printf("%llu meshes written to %s: %.3f s of the performance, %.1f MB, in %.1f s\n",
              static_cast<unsigned long long>(written), options.output.c_str(),
              seconds(*last - *begin), 1e-6 * static_cast<double>(bytes), taken.seconds());
  print_left_out(together, "meshes have the time of the one before");
  print_left_out(cursor.damaged(), "buffers are damaged");
  print_left_out(unreadable, "buffers are no meshes");
  return cursor.damaged() + unreadable > 0 ? 1 : 0;
}

/// Copies what is whole, in the order of time.
int recover(const std::string& path, const std::string& output) {
  const TakeContent content = read_take(path);
  TakeWriter take(output, TakeWriter::Existing::refuse);
  for (const TakeNote& note : content.notes) take.note(note.name, note.value);
  struct Source {
    Source(const std::string& path, std::int64_t from, std::int64_t to)
        : cursor(path, from), stream(to), next(cursor.next()) {}
    TakeCursor cursor;
    std::int64_t stream;
    std::optional<TakePacket> next;
    std::int64_t event = 0;
  };
  std::deque<Source> sources;
  for (const TakeStream& stream : content.streams)
    sources.emplace_back(path, stream.id, take.stream(stream.name));
  std::uint64_t copied = 0, damaged = 0;
  for (;;) {
    Source* first = nullptr;
    for (Source& source : sources)
      if (source.next && (first == nullptr || source.next->time < first->next->time))
        first = &source;
    if (first == nullptr) break;
    const std::int64_t event = first->next->event;
    if (std::exchange(first->event, event) != event)
      take.announce(first->stream, first->cursor.announcement(event));
    take.write(first->stream, *first->next, first->next->data);
    first->next = first->cursor.next();
    ++copied;
  }
  take.finish();
  for (const Source& source : sources) damaged += source.cursor.damaged();
  std::printf("%llu buffers copied to %s, %llu damaged ones left out\n",
              static_cast<unsigned long long>(copied), output.c_str(),
              static_cast<unsigned long long>(damaged));
  return damaged > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine command("polyhull-take", "Looks into takes that takesink wrote");
  std::string path, name, output;
  Export options;
  const auto takes = [&](CommandLine& subcommand) {
    subcommand.option("take", &path, "The take").required();
  };
  CommandLine shown = command.subcommand(
      "info",
      "What is in it; every buffer is read and held against its checksum (exit status 1: "
      "some are damaged)");
  takes(shown);
  CommandLine text = command.subcommand("extract", "Print a text that it keeps");
  takes(text);
  text.option("name", &name, "rig, settings").required();
  text.option("-o,--output", &output, "File to write instead");
  CommandLine meshes = command.subcommand("export", "Its meshes as files");
  takes(meshes);
  meshes
      .option("-o,--output", &options.output,
              "One animated .glb, or a numbered sequence (hull-%05d.glb, .ply, .obj)")
      .required();
  meshes.option("--stream", &options.stream, "Which stream, where several hold meshes");
  meshes.option("--from", &options.from, "Seconds").shown().not_negative();
  meshes.option("--to", &options.to, "Seconds, not included").range(0.0, 1e9);
  meshes.option("--every", &options.every, "Only every n-th mesh").shown().range(1, 1'000'000);
  meshes.option("--jpeg-quality", &options.quality, "Of GLB's pictures, 1 to 100; 0: PNG")
      .shown()
      .range(0, 100);
  CommandLine rescue = command.subcommand("recover", "Copy what is whole of a damaged one");
  takes(rescue);
  rescue.option("-o,--output", &output, "The take to write").required();
  return command.run(argc, argv, [&] {
    if (shown.given()) return info(path);
    if (text.given()) return extract(path, name, output);
    if (meshes.given()) return write_meshes(path, options);
    return recover(path, output);
  });
}
