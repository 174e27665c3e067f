"""The science of tfscope: volumes, rendering, training, the generator. Knows no Qt."""
