"""Tables in and out: FRFs, poles, sensors."""
