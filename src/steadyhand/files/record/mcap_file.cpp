// MCAP files of the operating system, their chunks compressed by zstd.
#include <fmt/format.h>
#include <zstd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "steadyhand/files/record/recorder.hpp"

namespace steadyhand {

namespace {

class McapFile final : public McapSink {
 public:
  McapFile(std::string path, int level, std::FILE* file)
      : path_(std::move(path)), level_(level), file_(file), compressor_(ZSTD_createCCtx()) {}

  std::string name() const override { return path_; }

  Status put(std::string_view bytes) override {
    errno = 0;
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) == bytes.size() && std::fflush(file_.get()) == 0) {
      position_ += bytes.size();
      return Done{};
    }
    return Error{fmt::format("writing {} bytes at {} failed: {}", bytes.size(), position_, std::strerror(errno))};
  }

  Status close() override {
    if (std::fclose(file_.release()) == 0) return Done{};
    return Error{fmt::format("closing failed: {}", std::strerror(errno))};
  }

  std::string_view compression() const override { return "zstd"; }

  Result<std::string_view> compress(std::string_view chunk) override {
    compressed_.resize(ZSTD_compressBound(chunk.size()));
    const std::size_t size = ZSTD_compressCCtx(compressor_.get(), compressed_.data(), compressed_.size(), chunk.data(),
                                               chunk.size(), level_);
    if (ZSTD_isError(size)) return Error{fmt::format("zstd: {}", ZSTD_getErrorName(size))};
    return std::string_view(compressed_).substr(0, size);
  }

 private:
  struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  struct CompressorDeleter {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };

  std::string path_;
  int level_;
  std::unique_ptr<std::FILE, FileCloser> file_;
  std::unique_ptr<ZSTD_CCtx, CompressorDeleter> compressor_;
  std::string compressed_;
  std::uint64_t position_ = 0;
};

}  // namespace

Result<std::unique_ptr<McapSink>> open_mcap_file(const std::string& path, const McapSettings& settings) {
  std::FILE* file = std::fopen(path.c_str(), settings.replace ? "wb" : "wbx");
  if (!file) return Error{fmt::format("{}: cannot be written: {}", path, std::strerror(errno))};
  return std::unique_ptr<McapSink>(std::make_unique<McapFile>(path, settings.compression_level, file));
}

Result<McapWriter> McapWriter::create(const std::string& path, const McapSettings& settings) {
  auto file = open_mcap_file(path, settings);
  if (!file) return file.error();
  return create(*std::move(file), settings);
}

Result<Recorder> Recorder::create(const std::string& path, const RecorderSettings& settings) {
  auto file = open_mcap_file(path, settings.mcap);
  if (!file) return file.error();
  return create(*std::move(file), settings);
}

}  // namespace steadyhand
