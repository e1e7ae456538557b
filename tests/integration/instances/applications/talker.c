/*
 * Answers each request on the channel "talk" with the same contents. With TALKER_PEER=NAME it sends requests
 * of changing size to that instance, one at a time, and says what came of it: "N replies", "N lost",
 * "wrong ...". With TALKER_ADDRESS=NUMBER it sends them to that address, and also says (as for a NAME@HOST)
 * "N not sent", "N cycles". With TALKER_CALL=1 it also calls all nodes every 100 cycles; each that hears it
 * says "called by N".
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../../../instances/plc_app.h"

#define PATIENCE 200 /* cycles */

static RTS_HANDLE channel;
static const char* peer_name;
static int calls;
static unsigned int peer = PLC_NO_NODE;
static unsigned char out[PLC_MAX_BLOCK];
static unsigned char in[PLC_MAX_BLOCK];
static unsigned int out_size;
static unsigned int correlation;
static unsigned int waiting; /* cycles since the request; 0: none is under way */
static unsigned int number, replies, lost, not_sent, cycles;
static int says_more;

static void say(const char* before, unsigned int value, const char* behind) {
  char text[PLC_LOG_MAX_TEXT];
  sprintf(text, "%s%u%s", before, value, behind);
  plc_log(PLC_LOG_INFO, text);
}

static void ask(void) {
  unsigned int i;
  if (peer == PLC_NO_NODE) peer = plc_node_address(peer_name);
  if (peer == PLC_NO_NODE) return;
  out_size = number * 7919u % (PLC_MAX_BLOCK + 1u);
  for (i = 0; i < out_size; i += 61u) out[i] = (unsigned char)(number + i);
  if (plc_channel_request(channel, peer, (int)(number % 4u), out, out_size, &correlation) != ERR_OK) {
    if (++not_sent % 100u == 0u && says_more) say("", not_sent, " not sent");
    return;
  }
  ++number;
  waiting = 1;
}

static void take(const Block_Info* info) {
  if (info->bKind == PLC_BLOCK_REQUEST) {
    (void)plc_channel_reply(channel, info, in, info->dwBytes);
  } else if (info->bKind == PLC_BLOCK_MESSAGE) {
    say("called by ", info->dwFrom, "");
  } else if (info->dwCorrelation == correlation && waiting != 0u) {
    if (info->dwFrom != peer || info->dwBytes != out_size || memcmp(in, out, out_size) != 0) {
      say("wrong reply to ", number, "");
    }
    waiting = 0;
    if (++replies % 100u == 0u) say("", replies, " replies");
  }
}

static void cycle(void) {
  Block_Info info;
  info.dwSize = sizeof info;
  while (plc_channel_receive(channel, in, sizeof in, &info) == ERR_OK) take(&info);
  if (waiting != 0u && ++waiting > PATIENCE) {
    waiting = 0;
    say("", ++lost, " lost");
  }
  if ((peer_name != NULL || peer != PLC_NO_NODE) && waiting == 0u) ask();
  ++cycles;
  if (says_more && cycles % 1000u == 0u) say("", cycles, " cycles");
  if (calls && cycles % 100u == 0u)
    (void)plc_channel_send(channel, PLC_ALL_NODES, PLC_BLOCK_HIGH, "hello", 5u);
}

static Task_Info task = {"Talk", 1, Cyclic, 0, 1, 0, "", cycle, 0, 0, 0, 0, 0, 0};
static sys_setup_tasks_struct setup = {1, "Talker", &task};

PLC_EXPORT_ABI;

int plc_app_init(void) {
  RTS_RESULT result;
  const char* address;
  peer_name = getenv("TALKER_PEER");
  calls = getenv("TALKER_CALL") != NULL;
  address = getenv("TALKER_ADDRESS");
  if (address != NULL) peer = (unsigned int)strtoul(address, NULL, 10);
  says_more = address != NULL || (peer_name != NULL && strchr(peer_name, '@') != NULL);
  channel = plc_channel_open("talk", &result);
  if (result != ERR_OK) return 1;
  say("talks from address ", plc_node_address(NULL), "");
  __sys__setup__tasks(&setup);
  return 0;
}
