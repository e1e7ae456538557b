# shm/plc_process_image.h: a word that a reader tells meanwhile holds
# caught as: the image of the end, although there is a new one
s/while \(plc_image_state\(image\) == PLC_IMAGE_STATE_SILENT\);/while (0);/
