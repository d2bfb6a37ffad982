#include "steadyhand/files/input/recording.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "steadyhand/core/text.hpp"
#include "steadyhand/files/input/aframe.hpp"
#include "steadyhand/files/input/csv.hpp"

namespace steadyhand {
namespace {

Result<std::string> read_file(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (path.empty()) return Error{"the path of the recording is empty"};
  if (!std::filesystem::exists(status)) return Error{fmt::format("{}: no such file", path.string())};
  if (!std::filesystem::is_regular_file(status)) {
    return Error{fmt::format("{}: is no regular file; a recording is a CSV or JSON file", path.string())};
  }
  std::ifstream stream(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) return Error{fmt::format("{}: cannot be read", path.string())};
  return text;
}

bool is_json(const std::filesystem::path& path, const std::string& text, std::size_t first) {
  return path.extension() == ".json" || text[first] == '{' || text[first] == '[';
}

Status check(const RecordingOptions& options) {
  if (!std::isfinite(options.from) || options.from < 0.0) {
    return Error{fmt::format("the recording's range starts at {} s; it must start at 0 s or later", options.from)};
  }
  if (!(options.until > options.from)) {
    return Error{fmt::format("the recording's range ends at {} s; it must end after its start, {} s", options.until,
                             options.from)};
  }
  return Done{};
}

}  // namespace

Result<Recording> load_recording(const std::filesystem::path& path, const RecordingOptions& options) {
  if (const Status valid = check(options); !valid) return valid.error();
  const Result<std::string> text = read_file(path);
  if (!text) return text.error();
  const std::string name = path.string();
  const std::size_t first = text->find_first_not_of(" \t\r\n");
  if (first == std::string::npos) {
    return Error{fmt::format("{}: is empty; a recording is a CSV or an A-Frame JSON file", name)};
  }

  if (is_lfs_pointer(*text)) return Error{fmt::format("{}: {}", name, kLfsPointer)};
  if (text->starts_with("\xFF\xFE") || text->starts_with("\xFE\xFF")) {
    return Error{fmt::format("{}: is UTF-16 text; save it as UTF-8", name)};
  }

  Recording recording;
  recording.name = path.stem().string();
  SampleList samples;
  std::vector<ChosenHand> hands;
  const ChooseHands choose = [&](const std::vector<std::string>& keys) -> Result<std::vector<ChosenHand>> {
    const bool is_unnamed = keys == std::vector<std::string>{""};
    if (is_unnamed && !options.track.empty()) {
      return Error{fmt::format("{}: is a CSV file and has no track \"{}\"; leave the track out", name, options.track)};
    }
    Result<std::vector<ChosenHand>> chosen = choose_hands(keys, options, name);
    if (!chosen) return chosen;
    hands = *chosen;
    for (const ChosenHand& hand : hands) recording.track += (recording.track.empty() ? "" : ",") + hand.key;
    recording.note = note_on_hands(keys, hands, name);
    return chosen;
  };
  if (is_json(path, *text, first)) {
    if (const Status read = read_aframe(*text, name, choose, samples); !read) return read.error();
  } else {
    if (const Status read = read_csv(*text, name, choose, samples); !read) return read.error();
  }
  for (const auto& [key, tool] : hands) {
    const std::size_t count = samples.count(tool);
    if (hands.size() < 2 || count >= 2) continue;
    return Error{fmt::format("{}: the hand \"{}\" has {} sample{}; it needs at least 2", name, key, count,
                             count == 1 ? "" : "s")};
  }
  Result<std::vector<OperatorSample>> taken = std::move(samples).take(options.from, options.until, name);
  if (!taken) return taken.error();
  recording.samples = *std::move(taken);
  return recording;
}

}  // namespace steadyhand
