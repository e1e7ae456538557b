// The slots of a process image: one writer, readers that are overtaken or not, and the safe image.

#include <array>

#include "instances/runtime/memory/silence.hpp"
#include "shm/plc_process_image.h"
#include "tests/models/checker/model.hpp"

namespace plchost::models {
namespace {

using Image = std::array<plc_image_u64, 2>;
constexpr unsigned kSize = sizeof(Image);
constexpr plc_image_u64 kSafe = 100;  // above all that are published
constexpr plc_image_u64 kVictim = 7;  // process numbers
constexpr plc_image_u64 kSuccessor = 8;

struct Shared {
  alignas(64) std::array<char, sizeof(plc_image_header) + (PLC_IMAGE_SLOTS + PLC_IMAGE_SAFE_SLOTS) *
                                                              (sizeof(plc_image_slot) + 64)> bytes{};
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
  void set_safe(plc_image_u64 value) {
    const Image image_of_value{value, value};
    plc_image_set_safe(&image, image_of_value.data());
  }
  void write_watched(plc_image_u64 value) {
    const Image image_of_value{value, value};
    const Image at_end{kSafe, kSafe};
    plc_image_write_watched(&image, image_of_value.data(), at_end.data());
  }
  void be_silent() {
    plc_image_i64& sign = image.header->heartbeat_ns;
    if (__atomic_load_n(&sign, __ATOMIC_RELAXED) != 0) __atomic_store_n(&sign, 1, __ATOMIC_RELAXED);
  }
  // The word that was told.
  plc_image_u64 stop() {
    set_safe(kSafe);
    plc_image_tell(&image, PLC_IMAGE_STATE_STOPPED, 1);
    return plc_image_control(&image);
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

// A task publishes, and its first image ends the safe state that it was armed with. A stop comes before that,
// meanwhile, or after it.
void a_task_is_stopped(Scene& scene) {
  Shared& shared = make(scene);
  shared.write(1);
  const plc_image_u64 armed = shared.stop();
  scene.thread("task", [&shared, armed] {
    shared.write(2);
    plc_image_resume(&shared.image, armed);
    shared.write(3);
  });
  const ThreadNumber control =
      scene.thread("control", [&] { plc_image_tell(&shared.image, PLC_IMAGE_STATE_EXCEPTION, 1); });
  scene.thread("terminal",
               [&] {
                 require(shared.read() == kSafe, "an image of a task that was stopped");
                 require(plc_image_state(&shared.image) == PLC_IMAGE_STATE_EXCEPTION, "another state");
               },
               {.after = static_cast<int>(control)});
}

// A terminal that sees the tasks run sees at least the image of the first cycle.
void a_first_cycle(Scene& scene) {
  Shared& shared = make(scene);
  shared.write(1);
  const plc_image_u64 armed = shared.stop();
  scene.thread("task", [&shared, armed] {
    shared.write(2);
    plc_image_resume(&shared.image, armed);
  });
  scene.thread("terminal", [&] {
    const bool runs = plc_image_state(&shared.image) == PLC_IMAGE_STATE_RUNNING;
    const plc_image_u64 seen = shared.read();
    require(seen == 2 || (seen == kSafe && !runs), "an image from before the first cycle");
  });
}

void a_safe_image_is_told(Scene& scene) {
  Shared& shared = make(scene);
  shared.write(1);
  scene.thread("writer", [&] { (void)shared.stop(); });
  scene.thread("terminal", [&] { require(shared.read() != 0, "no safe image, although it is told"); });
}

// The last image that was published becomes the safe one. A writer that is killed meanwhile leaves the one or
// the other, and the process that ends it the one that is to be shown then.
void a_writer_is_killed_while_it_stops(Scene& scene) {
  Shared& shared = make(scene);
  scene.limits({.kills = 1});
  shared.set_safe(kSafe);
  shared.write(1);
  __atomic_store_n(&shared.image.header->on_end, 1U, __ATOMIC_RELAXED);
  plc_image_take(&shared.image, kVictim);
  const ThreadNumber victim = scene.thread("victim",
                                           [&] {
                                             shared.set_safe(kSafe + 1);
                                             plc_image_tell(&shared.image, PLC_IMAGE_STATE_STOPPED, 1);
                                           },
                                           {.may_be_killed = true});
  scene.thread("manager",
               [&] {
                 (void)plc_image_end_of(&shared.image, kVictim);
                 require(shared.read() >= kSafe, "no safe image after the end");
                 require(plc_image_state(&shared.image) == PLC_IMAGE_STATE_ENDED, "another state");
               },
               {.after = static_cast<int>(victim)});
  scene.thread("terminal", [&] {
    const plc_image_u64 first = shared.read();
    require(first != 0, "no image, although there always is one");
    require(shared.read() >= first, "an older image than before");
  });
}

// The manager ends the image of a killed process while the next one takes it: that one's word holds, and its
// first cycle ends the safe state.
void the_next_writer_comes_first(Scene& scene) {
  Shared& shared = make(scene);
  shared.write(1);
  plc_image_take(&shared.image, kVictim);
  plc_image_tell(&shared.image, PLC_IMAGE_STATE_RUNNING, 0);
  __atomic_store_n(&shared.image.header->on_end, 1U, __ATOMIC_RELAXED);
  shared.set_safe(kSafe);
  scene.thread("manager", [&] { (void)plc_image_end_of(&shared.image, kVictim); });
  scene.thread("successor", [&] {
    plc_image_take(&shared.image, kSuccessor);
    const plc_image_u64 armed = shared.stop();
    require(plc_image_state(&shared.image) == PLC_IMAGE_STATE_STOPPED,
            "the end of the writer before in place of the next one");
    shared.write(2);
    plc_image_resume(&shared.image, armed);
    require(shared.read() == 2, "the end of the writer before in place of the next one");
  });
}

// An instance tells the silence of firmware that comes back just then.
void late_firmware_is_shown_again(Scene& scene) {
  Shared& shared = make(scene);
  shared.write_watched(1);
  shared.be_silent();
  scene.thread("firmware", [&] {
    shared.write_watched(2);
    require(shared.read() == 2, "the image of the end, although there is a new one");
  });
  scene.thread("instance", [&] { tell_silence(shared.image); });
}

void firmware_is_killed_in_its_first_call(Scene& scene) {
  Shared& shared = make(scene);
  scene.limits({.kills = 1});
  const ThreadNumber victim =
      scene.thread("firmware", [&] { shared.write_watched(1); }, {.may_be_killed = true});
  scene.thread("instance",
               [&shared, victim] {
                 shared.be_silent();
                 tell_silence(shared.image);
                 const plc_image_u64 seen = shared.read();
                 require(seen == kSafe || (seen == 0 && was_killed(victim)), "an image without an end");
               },
               {.after = static_cast<int>(victim)});
}

}  // namespace
}  // namespace plchost::models

int main(int argc, char** argv) {
  using namespace plchost::models;
  return run(argc, argv,
             {{"a_writer_and_two_readers", a_writer_and_two_readers},
              {"the_writer_goes_round", the_writer_goes_round},
              {"a_writer_is_killed", a_writer_is_killed},
              {"a_task_is_stopped", a_task_is_stopped},
              {"a_first_cycle", a_first_cycle},
              {"a_safe_image_is_told", a_safe_image_is_told},
              {"a_writer_is_killed_while_it_stops", a_writer_is_killed_while_it_stops},
              {"the_next_writer_comes_first", the_next_writer_comes_first},
              {"late_firmware_is_shown_again", late_firmware_is_shown_again},
              {"firmware_is_killed_in_its_first_call", firmware_is_killed_in_its_first_call}});
}
