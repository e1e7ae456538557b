// The slots of a process image: one writer, readers that are overtaken or not.

#include <array>

#include "shm/plc_process_image.h"
#include "tests/models/checker/model.hpp"

namespace plchost::models {
namespace {

using Image = std::array<plc_image_u64, 2>;
constexpr unsigned kSize = sizeof(Image);

struct Shared {
  alignas(64)
      std::array<char, sizeof(plc_image_header) + PLC_IMAGE_SLOTS * (sizeof(plc_image_slot) + 64)> bytes{};
  plc_image image{};

  Shared() {
    image.header = static_cast<plc_image_header*>(static_cast<void*>(bytes.data()));
    image.mapped = bytes.size();
    image.size = kSize;
    image.descriptor = -1;
    plc_image_begin(image.header, kSize);
  }
  void write(plc_image_u64 value) {
    const Image image_of_value{value, value};
    plc_image_write(&image, image_of_value.data());
  }
  // The image that was read, 0 if none was.
  plc_image_u64 read() {
    Image found{};
    if (plc_image_read(&image, found.data(), nullptr) != PLC_IMAGE_OK) return 0;
    require(found[0] == found[1], "half of another image");
    return found[0];
  }
};

Shared& make(Scene& scene) {
  auto& shared = scene.make<Shared>();
  scene.name(shared.bytes, "image");
  return shared;
}

void a_writer_and_two_readers(Scene& scene) {
  Shared& shared = make(scene);
  scene.thread("writer", [&] {
    shared.write(1);
    shared.write(2);
  });
  for (const char* name : {"reader", "other reader"}) {
    scene.thread(name, [&] {
      const plc_image_u64 first = shared.read();
      const plc_image_u64 second = shared.read();
      require(second >= first, "an older image than before");
    });
  }
}

// The writer goes round all slots while a reader is within one.
void the_writer_goes_round(Scene& scene) {
  Shared& shared = make(scene);
  scene.limits({.steps = 600});
  shared.write(1);
  scene.thread("writer", [&] {
    for (plc_image_u64 value = 2; value <= PLC_IMAGE_SLOTS + 2; ++value) shared.write(value);
  });
  scene.thread("reader", [&] { shared.read(); });
}

// The next writer goes on with the slot that the killed one has left half-written.
void a_writer_is_killed(Scene& scene) {
  Shared& shared = make(scene);
  scene.limits({.kills = 1});
  shared.write(1);
  const ThreadNumber victim = scene.thread("victim", [&] { shared.write(2); }, {.may_be_killed = true});
  scene.thread("successor",
               [&] {
                 shared.write(3);
                 require(shared.read() == 3, "the successor's image is not there");
               },
               {.after = static_cast<int>(victim)});
  scene.thread("reader", [&] { require(shared.read() != 0, "no image, although there always is one"); });
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"a_writer_and_two_readers", a_writer_and_two_readers},
              {"the_writer_goes_round", the_writer_goes_round},
              {"a_writer_is_killed", a_writer_is_killed}});
}
