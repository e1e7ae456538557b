/*
 * The value of a place, in the program and in its area. It is a number of up to 64 bits, of a bit 0 or 1. For
 * places.c.
 */
#ifndef PLCHOST_PLACE_VALUES_H
#define PLCHOST_PLACE_VALUES_H

#include <string.h>

#include "plchost_adapter.h"

#define ALL_BITS (~0ull)

/* Values lie at multiples of their size, places do not. A task that sees what another one has written sees
 * all that this one has done before. */
static inline unsigned long long value_at(const void* value, unsigned int bytes) {
  switch (bytes) {
    case 1:
      return __atomic_load_n((const unsigned char*)value, __ATOMIC_ACQUIRE);
    case 2:
      return __atomic_load_n((const unsigned short*)value, __ATOMIC_ACQUIRE);
    case 4:
      return __atomic_load_n((const unsigned int*)value, __ATOMIC_ACQUIRE);
    default:
      return __atomic_load_n((const unsigned long long*)value, __ATOMIC_ACQUIRE);
  }
}
static inline unsigned long long value_of(const struct plchost_place* place, const void* value) {
  const unsigned long long now = value_at(value, place->bytes);
  return place->bit < 0 ? now : now != 0;
}
static inline void set_value(void* value, unsigned int bytes, unsigned long long now) {
  switch (bytes) {
    case 1:
      __atomic_store_n((unsigned char*)value, (unsigned char)now, __ATOMIC_RELEASE);
      break;
    case 2:
      __atomic_store_n((unsigned short*)value, (unsigned short)now, __ATOMIC_RELEASE);
      break;
    case 4:
      __atomic_store_n((unsigned int*)value, (unsigned int)now, __ATOMIC_RELEASE);
      break;
    default:
      __atomic_store_n((unsigned long long*)value, now, __ATOMIC_RELEASE);
  }
}
/* Unless another task has changed it meanwhile: then 0. */
#define SET_IF(type)                                                                            \
  {                                                                                             \
    type expected = (type)before;                                                               \
    return __atomic_compare_exchange_n((type*)value, &expected, (type)now, 0, __ATOMIC_SEQ_CST, \
                                       __ATOMIC_SEQ_CST);                                       \
  }
static inline int set_value_if(void* value, unsigned int bytes, unsigned long long before,
                               unsigned long long now) {
  switch (bytes) {
    case 1:
      SET_IF(unsigned char)
    case 2:
      SET_IF(unsigned short)
    case 4:
      SET_IF(unsigned int)
    default:
      SET_IF(unsigned long long)
  }
}

/* Others write and read the memory area meanwhile: of such a value they, and this task, see no half. */
static inline int is_whole(const struct plchost_place* place, const unsigned char* area) {
  return (unsigned long)(area + place->offset) % place->bytes == 0;
}

static inline unsigned long long load(const struct plchost_place* place, const unsigned char* area) {
  unsigned long long value = 0;
  if (is_whole(place, area))
    value = value_at(area + place->offset, place->bytes);
  else
    memcpy(&value, area + place->offset, place->bytes);
  return place->bit < 0 ? value : (value >> place->bit) & 1u;
}

/* The bits of two values that are not the same: of a place that shares none, all or none. */
static inline unsigned long long differ(const struct plchost_place* place, unsigned long long one,
                                        unsigned long long other) {
  if (place->aliased) return one ^ other;
  return one == other ? 0 : ALL_BITS;
}
static inline unsigned long long mixed(unsigned long long value, unsigned long long other,
                                       unsigned long long bits) {
  return (value & ~bits) | (other & bits);
}

static inline long first_bit(const struct plchost_place* place) {
  return (long)place->offset * 8 + (place->bit < 0 ? 0 : place->bit);
}
/* Bits of one place, as they lie in another one. */
static inline unsigned long long bits_in(const struct plchost_place* other, const struct plchost_place* place,
                                         unsigned long long bits) {
  const long distance = first_bit(other) - first_bit(place);
  const unsigned long long all = other->bit >= 0 ? 1 : ALL_BITS >> (64 - 8 * other->bytes);
  if (distance >= 64 || distance <= -64) return 0;
  return (distance < 0 ? bits << -distance : bits >> distance) & all;
}

#endif
