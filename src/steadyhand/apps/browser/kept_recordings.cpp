#include "steadyhand/apps/browser/kept_recordings.hpp"

namespace steadyhand {

namespace {

class KeptRecording final : public McapSink {
 public:
  KeptRecording(std::string name, KeptRecordings::Keep keep) : name_(std::move(name)), keep_(std::move(keep)) {}
  std::string name() const override { return name_; }
  Status put(std::string_view bytes) override {
    keep_(name_, bytes);
    return Done{};
  }
  Status close() override {
    keep_(name_, {});
    return Done{};
  }

 private:
  std::string name_;
  KeptRecordings::Keep keep_;
};

}  // namespace

Result<RecordingPlace::Opened> KeptRecordings::open(const std::function<std::string(int)>& numbered) {
  for (int i = 1;; ++i) {
    const std::string name = numbered(i);
    if (names_.insert(name).second) return Opened{name, name, std::make_unique<KeptRecording>(name, keep_)};
  }
}

}  // namespace steadyhand
