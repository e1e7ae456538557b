/*
 * A packer, in plain C against plc_app.h. Products arrive one by one, each announced by the external event
 * "product"; none may be lost. Twelve make a carton, six cartons a layer, five layers a pallet.
 *
 *   Product    external event  "product": counts, and puts a full carton on the belt
 *   Palletise  freewheeling    takes cartons from the belt as they come, and stacks them
 *   Report     cyclic, 1 s     one line of figures; not real-time
 *
 * Its counts outlive a crash and a power cut (area "counts"). With an I/O terminal (areas "panel.out",
 * "panel.in") Palletise shows its figures on the channels 0 to 2 of a panel, which echoes them.
 */
#include <stdio.h>

#include "plc_app.h"

#define PRODUCTS_PER_CARTON 12ul
#define CARTONS_PER_LAYER 6ul
#define LAYERS_PER_PALLET 5ul
#define CHANNELS 64

/* Each has one writer, the task named behind it; the others only read. */
typedef struct {
  volatile unsigned long products;     /* Product */
  volatile unsigned long cartons_made; /* Product: put on the belt */
  volatile unsigned long cartons_used; /* Palletise: taken from the belt */
  volatile unsigned long layers;       /* Palletise */
  volatile unsigned long pallets;      /* Palletise */
} counts_t;
static counts_t* counts;

static unsigned short* panel_out;
static unsigned short* panel_in;
static volatile unsigned int panel_pallets; /* Palletise: as the panel shows them */

static void CDECL product(void) {
  counts->products = counts->products + 1;
  if (counts->products % PRODUCTS_PER_CARTON == 0) counts->cartons_made = counts->cartons_made + 1;
}

static void stack_carton(void) {
  counts->cartons_used = counts->cartons_used + 1;
  if (counts->cartons_used % CARTONS_PER_LAYER != 0) return;
  counts->layers = counts->layers + 1;
  if (counts->layers % LAYERS_PER_PALLET == 0) counts->pallets = counts->pallets + 1;
}

static void CDECL palletise(void) {
  while (counts->cartons_used != counts->cartons_made) stack_carton();
  panel_out[0] = (unsigned short)counts->cartons_made;
  panel_out[1] = (unsigned short)counts->layers;
  panel_out[2] = (unsigned short)counts->pallets;
  panel_pallets = panel_in[2];
}

static void CDECL report(void) {
  char text[PLC_LOG_MAX_TEXT];
  sprintf(text, "products %lu, cartons %lu (on the belt %lu), layers %lu, pallets %lu, panel %u",
          counts->products, counts->cartons_made, counts->cartons_made - counts->cartons_used, counts->layers,
          counts->pallets, panel_pallets);
  plc_log(PLC_LOG_INFO, text);
}

/* Name, priority, kind, unit, interval, BOOL, external event, cycle; the runtime fills in the rest. */
static Task_Info tasks[] = {
    {"Product", 1, External, 0, 0, NULL, "product", product, 0, 0, 0, 0, 0, 0},
    {"Palletise", 18, Freewheeling, 0, 0, NULL, "", palletise, 0, 0, 0, 0, 0, 0},
    {"Report", 20, Cyclic, 0, 1000, NULL, "", report, 0, 0, 0, 0, 0, 0},
};
static sys_setup_tasks_struct configuration = {sizeof tasks / sizeof tasks[0], "Packer", tasks};

static RTS_HANDLE product_event = RTS_INVALID_HANDLE;

PLC_EXPORT_ABI;

static RTS_RESULT declare(const char* name, unsigned int flags, unsigned int bytes, const Plc_Area_Use* uses,
                          unsigned int number_of_uses, void** address) {
  static const Plc_Area none;
  Plc_Area area = none;
  RTS_RESULT result;
  area.dwSize = sizeof area;
  area.dwFlags = flags;
  area.pszName = name;
  area.dwBytes = bytes;
  area.nUses = number_of_uses;
  area.pUses = uses;
  area.ppAddress = address;
  plc_declare_area(&area, &result);
  return result;
}

static RTS_RESULT declare_areas(void) {
  static const Plc_Area_Use counting[] = {{"Product", 0, 0, NULL}, {"Palletise", 0, 0, NULL}};
  static const Plc_Area_Use showing[] = {{"Palletise", 0, CHANNELS * sizeof(unsigned short), NULL}};
  static const Plc_Area_Use looking[] = {{"Palletise", 0, 0, NULL}};
  RTS_RESULT result = declare("counts", PLC_AREA_RETAIN, sizeof *counts, counting, 2, (void**)&counts);
  if (result == ERR_OK) {
    result = declare("panel.out", PLC_AREA_OUTPUT, CHANNELS * sizeof(unsigned short), showing, 1,
                     (void**)&panel_out);
  }
  if (result == ERR_OK) {
    result =
        declare("panel.in", PLC_AREA_INPUT, CHANNELS * sizeof(unsigned short), looking, 1, (void**)&panel_in);
  }
  return result;
}

/* The pallets as the panel shows them, for "plcctl read". */
static void declare_variables(void) {
  static Plc_Variable pallets;
  pallets.dwSize = sizeof pallets;
  pallets.pszName = "Panel.pallets";
  pallets.dwType = PLC_TYPE_UDINT;
  pallets.pAddress = (void*)(size_t)&panel_pallets; /* without its volatile */
  pallets.pszTask = "Palletise";
  plc_declare_variable(&pallets);
}

int CDECL plc_app_init(void) {
  RTS_RESULT result = declare_areas();
  if (result != ERR_OK) return (int)result;
  __sys__setup__tasks(&configuration);
  declare_variables();
  product_event = SchedRegisterExternalEvent("product", &result);
  return product_event == RTS_INVALID_HANDLE ? (int)result : 0;
}

void CDECL plc_app_exit(void) {
  SchedUnregisterExternalEvent(product_event);
}
