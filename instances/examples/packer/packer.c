/*
 * A packer, in plain C against plc_app.h. Products arrive one by one, each announced by the external event
 * "product"; none may be lost. Twelve make a carton, six cartons a layer, five layers a pallet.
 *
 *   Product    external event  "product": counts, and puts a full carton on the belt
 *   Palletise  freewheeling    takes cartons from the belt as they come, and stacks them
 *   Report     cyclic, 1 s     one line of figures; not real-time
 */
#include <stdio.h>

#include "../../plc_app.h"

#define PRODUCTS_PER_CARTON 12ul
#define CARTONS_PER_LAYER 6ul
#define LAYERS_PER_PALLET 5ul

/* Each has one writer, the task named behind it; the others only read. */
static volatile unsigned long products;     /* Product */
static volatile unsigned long cartons_made; /* Product: put on the belt */
static volatile unsigned long cartons_used; /* Palletise: taken from the belt */
static volatile unsigned long layers;       /* Palletise */
static volatile unsigned long pallets;      /* Palletise */

static void CDECL product(void) {
  products = products + 1;
  if (products % PRODUCTS_PER_CARTON == 0) cartons_made = cartons_made + 1;
}

static void CDECL palletise(void) {
  while (cartons_used != cartons_made) {
    cartons_used = cartons_used + 1;
    if (cartons_used % CARTONS_PER_LAYER != 0) continue;
    layers = layers + 1;
    if (layers % LAYERS_PER_PALLET == 0) pallets = pallets + 1;
  }
}

static void CDECL report(void) {
  char text[PLC_LOG_MAX_TEXT];
  sprintf(text, "products %lu, cartons %lu (on the belt %lu), layers %lu, pallets %lu", products,
          cartons_made, cartons_made - cartons_used, layers, pallets);
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

int CDECL plc_app_init(void) {
  RTS_RESULT result = ERR_OK;
  __sys__setup__tasks(&configuration);
  product_event = SchedRegisterExternalEvent("product", &result);
  return product_event == RTS_INVALID_HANDLE ? (int)result : 0;
}

void CDECL plc_app_exit(void) {
  SchedUnregisterExternalEvent(product_event);
}
