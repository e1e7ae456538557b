// Any file is either a whole retain image, and the same bytes again when it is written, or refused. The
// fuzzer cannot guess a checksum: half of the runs get a right one.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string>

#include "instances/runtime/memory/retain_image.hpp"

namespace {

void check(const std::string& file) {
  const auto image = plchost::decode_retain(file);
  if (!image) {
    if (image.error().code != plchost::ErrorCode::corrupt) std::abort();
    return;
  }
  if (!plchost::check_layout(image->layout) || image->data.size() != image->layout.bytes) std::abort();
  const auto again = plchost::decode_retain(plchost::encode(*image));
  if (!again || *again != *image) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string file(reinterpret_cast<const char*>(data), size);
  check(file);
  const std::uint64_t sum = plchost::crc64(std::as_bytes(std::span(file.data(), file.size())));
  file.append(reinterpret_cast<const char*>(&sum), sizeof sum);
  check(file);
  return 0;
}
