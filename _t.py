import numpy as np
from simulator import SceneGraphMemory, Sighting, Bayesian
from simulator.robot.finder import Finder
m=SceneGraphMemory(); k=m.add_room('kitchen'); f=m.add_furniture('fridge',k); c=m.add_furniture('counter top',k); t=m.add_furniture('dining table',k)
m.observe(f,[Sighting('milk','in')]); m.observe(c,[Sighting('large red mug'),Sighting('kettle')]); m.step(); m.observe(t,[])
fd=Finder(Bayesian())
for q in('the mug','scissors','milk','cup'): print(fd.rank(m,q))
s=fd.search(m,'red mug')
while (l:=s.next()) is not None:
    print(l.place.name, round(l.place.probability,2)); s.not_found()
print(s.outcome)
print(fd.search_plan(m,'milk'))
