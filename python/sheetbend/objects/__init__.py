"""What scenes are made of: ropes, rods, grips, arms, cloth and its fabric, tools; and places of markers on them."""
